"""A ROS 2 node around the pipeline: readings and force in, modulus, wavelength and friction out.

It was not run: papilla's tests have no ROS.

    ros2 run --prefix "python3" ros2_node.py --ros-args -p calibration:=calibration/calibration.json

In: `finger/sample`, std_msgs/Float64MultiArray, the readings of the gauges (microstrain) and then the force (N), at the
rate of the sensor. Out: `finger/estimate`, the same type, modulus (MPa), its sigma, wavelength (mm), its sigma, kinetic
friction and its sigma, NaN where there is no answer; and `finger/status`, std_msgs/String, whenever it changes.
"""

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray, String

from papilla.calibration import Calibration
from papilla.estimators import Pipeline


class Finger(Node):
    """Feeds every sample to the pipeline and publishes what it answers."""

    def __init__(self) -> None:
        super().__init__("papilla")
        path = self.declare_parameter("calibration", "calibration/calibration.json").value
        rate = self.declare_parameter("sample_rate_Hz", 1000.0).value
        self.pipeline = Pipeline(Calibration.load(path), columns=("force_N",), sample_rate_Hz=rate)
        self.estimate = self.create_publisher(Float64MultiArray, "finger/estimate", 10)
        self.status = self.create_publisher(String, "finger/status", 10)
        self.said = ""
        self.create_subscription(Float64MultiArray, "finger/sample", self.take, 100)

    def take(self, sample: Float64MultiArray) -> None:
        """One sample: the clock is that of this computer."""
        now = 1e-9 * self.get_clock().now().nanoseconds
        try:
            found = self.pipeline.update((now, *sample.data))
        except ValueError as error:  # A sample with other columns: say so, and go on
            self.get_logger().error(str(error))
            return
        softness = found.modulus_MPa, found.modulus_sigma_MPa
        roughness = found.wavelength_mm, found.wavelength_sigma_mm
        friction = found.mu_kinetic, found.mu_kinetic_sigma
        self.estimate.publish(Float64MultiArray(data=[*softness, *roughness, *friction]))
        if found.status != self.said:
            self.said = found.status
            self.status.publish(String(data=self.said))


def main() -> None:
    """Run until interrupted."""
    rclpy.init()
    rclpy.spin(Finger())


if __name__ == "__main__":
    main()
