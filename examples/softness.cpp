// The modulus from readings and force, one line a sample: the exported header in a program of its own.
//
//     papilla export-c calibration/calibration.json --out papilla.h
//     c++ -std=c++11 -O2 softness.cpp -o softness
//     ./softness < readings.txt        each line: the readings (microstrain), then the force (N)

#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "papilla.h"

namespace {

const char *words(papilla_status status)
{
    switch (status) {
    case PAPILLA_OK: return "ok";
    case PAPILLA_FORCE_OUTSIDE: return "force outside of the calibration";
    case PAPILLA_NO_READING: return "no reading";
    case PAPILLA_SOFTER: return "softer than the calibration";
    case PAPILLA_HARDER: return "not identifiable: harder than the calibration";
    }
    return "unknown";
}

}  // namespace

int main()
{
    const papilla_real noise = 5, force_noise = papilla_real(2e-3);  // of a gauge in microstrain, of the force in N
    std::string line;
    while (std::getline(std::cin, line)) {
        std::istringstream cells(line);
        std::vector<papilla_real> values;
        for (papilla_real value; cells >> value;) values.push_back(value);
        if (values.size() < 3) {
            std::cerr << "expected two readings at least, and a force: " << line << "\n";
            return 2;
        }
        const papilla_real force = values.back();
        values.pop_back();
        const int gauges = static_cast<int>(values.size());
        const papilla_real sd = papilla_sd(values.data(), gauges);
        const papilla_real sd_noise = noise / std::sqrt(static_cast<papilla_real>(gauges));
        const papilla_answer found = papilla_softness(sd, force, sd_noise, force_noise);
        std::cout << found.modulus_MPa << " MPa, " << found.lower_MPa << " to " << found.upper_MPa << " (95 %), "
                  << words(found.status) << std::endl;
    }
    return 0;
}
