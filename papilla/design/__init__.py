"""Studies of designs: which finger tells what is asked for, of a few designs or of many.

Shapes are an outer sample: each is a moved mesh, reduced over the ratio of the layers' moduli (`geometry`). Moduli,
places of gauges, gains and levers are arithmetic on what that left behind (`places`, `look`).
"""
