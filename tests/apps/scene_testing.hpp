#pragma once

// A scene with everything, and ways to change it.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace flexboom {

inline const std::filesystem::path meshes = std::filesystem::path(FLEXBOOM_TEST_DATA).parent_path() / "meshes";

// A scene that uses every key away from its default.
inline const char* const full_scene = R"(format = "flexboom-scene-1"
name = "everything"
duration = 3
output_step = 0.1
vtu_step = 0.5
accuracy = { tolerance = 1e-3, outputs = ["hub.rate", "box.angle"], budget = false }
integrator = { method = "adams", tolerance = 1e-4, formulation = "relative", settle = 1e-7, rescale_at_events = true }
orbit = { altitude = 5e5, inclination = 1.5, gravity = "differential", J2 = true }
hub = { mass = 8.5, inertia = [0.1, 0.12, 0.05], fixed = false, size = [0.1, 0.2, 0.3] }
initial = { rate = [0.1, -0.2, 0.3], velocity = [1, 2, 3e-3] }
[[bodies]]
name = "box"
structure = "beam"
modes = "auto"
directions = "all"
order = 3
theory = "timoshenko"
shear = 0.85
rotary_inertia = false
backend = "dense"
damping = { rule = "rayleigh", alpha = 0.1, beta = 1e-5 }
[bodies.solid]
element = "hex20"
accuracy = 1e-5
order = 3
slit = 1e-4
[bodies.solid.grading]
sectors = 2
rings = 1
long_elements = 7
end_layers = 2
first_layer = 0.5
growth = 2.5
corner_levels = 1
factor = 0.2
[[bodies.segments]]
shape = "rectangular-tube"
height = 0.02
width = 0.01
thickness = 0.001
length = 0.2
elements = 3
material = { E = 7e10, nu = 0.3, rho = 2700 }
[[bodies.segments]]
shape = "general"
A = 1e-5
Iy = 1e-10
Iz = 2e-10
J = 3e-10
kappa_y = 0.8
end = { A = 2e-5, kappa_z = 0.7 }
length = 0.1
material = { E = 7e10, nu = 0.3, rho = 2700 }
[[bodies.attachments]]
name = "head"
position = "tip"
mass = 0.1
inertia = [[1e-4, 1e-6, 0], [1e-6, 1e-4, 0], [0, 0, 1e-4]]
offset = [0.01, 0, 0]
[[bodies.attachments]]
position = 0.15
mass = 0.01
[[hinges]]
body = "box"
point = [0.05, 0, 0]
stowed = [0.6, 0.8, 0]
outward = [0, 0, 1]
stiffness = 0.3
rest = 1.3
P2 = 0.02
P3 = 11
threshold = 1.4
start_angle = 0.1
start_rate = -0.1
)";

// A scene that uses every key of a tree.
inline const char* const full_tree = R"toml(format = "flexboom-scene-1"
name = "everything"
duration = 2
gravity = [0, 0, -9.81]
accuracy = { tolerance = 1e-5, outputs = ["lift.length", "arm.tip", "wheel.spin"], budget = false }
integrator = { method = "bdf" }
[[bodies]]
name = "hub"
mass = 8.5
inertia = [0.1, 0.12, 0.05]
centre = [0, 0, 0.1]
size = [0.1, 0.2, 0.3]
[[bodies]]
name = "arm"
stiffening = "on"
modes = 2
shapes = [1, 2]
[[bodies.segments]]
shape = "tube"
diameter = 0.02
thickness = 0.001
length = 0.5
material = { E = 7e10, nu = 0.3, rho = 2700 }
[[bodies.attachments]]
name = "head"
position = 0.4
mass = 0.1
[[bodies]]
name = "hook"
mass = 1
inertia = [1e-3, 1e-3, 1e-3]
[[bodies]]
name = "ball"
mass = 1
inertia = [1e-3, 1e-3, 1e-3]
[[bodies]]
name = "drifter"
mass = 1
inertia = [1e-3, 1e-3, 1e-3]
[[joints]]
name = "lift"
kind = "slider"
a = { point = [1, 0, 0], x = [0, 1, 0], z = [1, 0, 0] }
b = { body = "hub" }
stiffness = 100
rest = 0.1
damping = 2
stop_stiffness = 1e4
threshold = 0.2
drive = "2*sin(t)"
start = 0.05
start_rate = -0.1
loads = true
[[joints]]
name = "shoulder"
kind = "hinge"
a = { body = "hub", point = [0, 0, 0.2], x = [0.70710678, 0.70710678, 0] }
b = { body = "arm", marker = "root" }
motion = { profile = "trapezoid", angle = 1.5, peak_rate = 2, peak_acceleration = 5 }
[[joints]]
name = "wrist"
kind = "universal"
a = { body = "arm", marker = "tip" }
b = { body = "hook" }
motion = ["0.1*t^2", 0.2]
[[joints]]
name = "string"
kind = "spherical"
a = { body = "arm", marker = "head" }
b = { body = "ball", point = [0, 0, 0.2] }
start_attitude = [0.6, 0.8, 0, 0]
start_omega = [0.1, 0.2, 0.3]
[[joints]]
name = "drifter"
kind = "free"
b = { body = "drifter" }
start_attitude = [0.6, 0, 0.8, 0]
start_omega = [0.01, 0.02, 0.03]
start_position = [3, 2, 1]
start_velocity = [0.1, 0, 0.2]
[[springs]]
name = "tether"
a = { body = "ball" }
b = { body = "ground", point = [1, 1, 1] }
stiffness = 3
free_length = 0.1
damping = 0.2
[[loads]]
name = "push"
at = { body = "arm", marker = "tip" }
axes = "inertial"
force = [0, "exp(-t)", 1.5]
torque = [0, 0, "t*(t<1)"]
[[wheels]]
name = "wheel"
body = "hub"
axis = [0, 1, 0]
inertia = 0.01
spin = 100
torque = { time = [0, 1, 2], value = [0, 0.1, 0], interpolation = "linear" }
)toml";

// One flexible boom that swings on a hub: a scene of [hub] and [[hinges]], and the same with [[joints]].
inline const char* const swinging_boom = R"(format = "flexboom-scene-1"
name = "swing"
duration = 0.5
output_step = 0.01
[[bodies]]
name = "boom"
modes = 1
damping = { rule = "modal", value = 0.05 }
[[bodies.segments]]
shape = "round-bar"
diameter = 0.006
length = 0.5
material = { E = 70e9, nu = 0.33, rho = 2700 }
)";

inline const std::string swing_on_hinge = std::string(swinging_boom) + R"([hub]
mass = 8.5
inertia = [0.13, 0.1, 0.06]
[[hinges]]
body = "boom"
point = [0.05, 0, 0]
stowed = [0, 1, 0]
outward = [1, 0, 0]
stiffness = 1
P2 = 0.02
P3 = 0
start_angle = 1.5
)";

inline const std::string swing_on_joints = std::string(swinging_boom) + R"([[bodies]]
name = "hub"
mass = 8.5
inertia = [0.13, 0.1, 0.06]
[[joints]]
name = "hub"
kind = "free"
b = { body = "hub" }
[[joints]]
name = "hinge"
kind = "hinge"
a = { body = "hub", point = [0.05, 0, 0] }
b = { body = "boom", marker = "root" }
stiffness = 1
damping = 0.02
start = 0.07
)";

inline std::string with(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

}  // namespace flexboom
