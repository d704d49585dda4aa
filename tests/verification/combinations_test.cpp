// Every feature of a scene with every other, by relative coordinates and by multipliers: one motion.

#include "apps/results/report.hpp"
#include "apps/results/results_folder.hpp"
#include "reduction/body_file/body_file.hpp"
#include "tests/apps/run_testing.hpp"

#include <gtest/gtest.h>
#include <unistd.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace flexboom {
namespace {

using Eigen::VectorXd;

/// What a scene may have beside a hub with a boom.
struct Feature {
  const char* name;
  std::string tables;                                           // appended
  std::vector<std::pair<const char*, const char*>> edits = {};  // of the text
};

constexpr const char* hub_with_a_boom = R"toml(format = "flexboom-scene-1"
name = "combination"
duration = 0.2
output_step = 0.02
accuracy = { tolerance = 1e-8, budget = false }
hub = { mass = 8.5, inertia = [[0.10, 0.001, 0], [0.001, 0.14, 0], [0, 0, 0.06]] }
initial = { rate = [0.01, 0.02, -0.015] }

[[bodies]]
name = "boom"
structure = "beam"
modes = 2
segments = [{ shape = "round-bar", diameter = 0.008, length = 0.5, material = { E = 67e9, nu = 0.33, rho = 2840 } }]

[[hinges]]
body = "boom"
point = [0.1, 0.05, 0.15]
stowed = [0, 0, -1]
outward = [1, 0, 0]
stiffness = 0.3
P2 = 0.002
start_angle = 1.2
)toml";

constexpr const char* panel = R"toml(
[[bodies]]
name = "panel"
mass = 0.6
inertia = [0.004, 0.002, 0.006]
centre = [0.1, 0, 0]
[[joints]]
name = "panel"
kind = "hinge"
a = { body = "hub", point = [-0.1, 0, 0.1], x = [0, 1, 0], z = [1, 0, 0] }
b = { body = "panel" }
stiffness = 0.2
damping = 0.01
rest = 0.1
start = 0.4
loads = true
)toml";

constexpr const char* mast = R"toml(
[[bodies]]
name = "mast"
mass = 0.3
inertia = [0.001, 0.002, 0.002]
centre = [0, 0.1, 0]
[[joints]]
name = "mast"
kind = "universal"
a = { body = "hub", point = [0, -0.1, 0] }
b = { body = "mast" }
motion = ["0.2*sin(3*t)", "0.1*(1 - cos(5*t))"]
)toml";

constexpr const char* turning = R"toml(
[[wheels]]
name = "wx"
body = "hub"
axis = [1, 0, 0]
inertia = 1e-3
[[wheels]]
name = "wy"
body = "hub"
axis = [0, 1, 0]
inertia = 1e-3
[[wheels]]
name = "wz"
body = "hub"
axis = [0, 0, 1]
inertia = 1e-3
[[turns]]
body = "hub"
axis = [0, 0, 1]
angle = 0.01
peak_rate = 0.2
peak_acceleration = 2
)toml";

std::vector<Feature> features(const std::filesystem::path& body_file) {
  const std::string filed =
      "\n[[bodies]]\nname = \"filed\"\nfile = \"" + body_file.string() +
      "\"\n[[joints]]\nname = \"filed\"\nkind = \"hinge\"\na = { body = \"hub\", point = [0, 0.1, "
      "0] }\nb = { body = \"filed\", marker = \"root\" }\nstiffness = 0.5\ndamping = 0.001\nstart "
      "= 0.2\nrest = 0.3\n";
  return {
      {"orbit",
       "\n[orbit]\naltitude = 4e5\ninclination = 0.9\neccentricity = 0.01\nnode = 0.3\nanomaly = 1\n"
       "gravity = \"differential\"\nJ2 = true\n"},
      {"joints", panel},
      {"wheels",
       "\n[[wheels]]\nname = \"wheel\"\nbody = \"hub\"\naxis = [0.6, 0, 0.8]\ninertia = 2e-3\n"
       "torque = \"1e-3*sin(9*t)\"\n"},
      {"turns", turning, {{"initial = { rate = [0.01, 0.02, -0.015] }\n", ""}}},
      {"loads",
       "\n[[loads]]\nname = \"push\"\nat = { body = \"boom\", marker = \"tip\" }\naxes = \"inertial\"\n"
       "force = [0.01, \"0.02*sin(20*t)\", 0.005]\n"},
      {"springs",
       "\n[[springs]]\nname = \"string\"\na = { body = \"hub\", point = [0, 0, 0.3] }\n"
       "b = { body = \"boom\", marker = \"tip\" }\nstiffness = 2\nfree_length = 0.3\ndamping = 0.01\n"},
      {"stiffening", "", {{"modes = 2\n", "modes = 2\nstiffening = \"on\"\n"}}},
      {"stops", "", {{"start_angle = 1.2\n", "start_angle = 1.55\nstart_rate = 0.5\nP3 = 20.0\n"}}},
      {"motion", mast},
      {"solid", "", {{"structure = \"beam\"\n", "structure = \"solid\"\nsolid = { accuracy = 1e-2 }\n"}}},
      {"file", filed},
      {"eq14", "", {{"structure = \"beam\"\n", "structure = \"eq14\"\n"}}},
  };
}

/// Pairs that have no motion, and the words that say why.
const std::map<std::set<std::string>, const char*> impossible = {
    {{"solid", "eq14"}, nullptr},  // two structures of one body: no scene
    {{"stiffening", "eq14"}, "has none; use \"beam\""},
    {{"turns", "wheels"}, nullptr},  // wheels that turn, others that have a torque: no start from rest
    {{"turns", "stops"}, "start from rest"},
};

std::string text_of(const std::vector<const Feature*>& chosen) {
  std::string text = hub_with_a_boom;
  for (const Feature* f : chosen) {
    for (const auto& [old, replacement] : f->edits) {
      const size_t at = text.find(old);
      EXPECT_NE(at, std::string::npos) << f->name << ": " << old;
      text.replace(at, std::string(old).size(), replacement);
    }
    text += f->tables;
  }
  return text;
}

/// Largest difference of each output over its largest value; a vector is one output.
double apart(const RunResult& a, const RunResult& b, std::string& worst) {
  EXPECT_EQ(a.outputs.names, b.outputs.names);
  if (a.outputs.names != b.outputs.names || a.outputs.values.rows() != b.outputs.values.rows()) return INFINITY;
  std::map<std::string, std::pair<double, double>> outputs;  // difference, size
  for (size_t i = 0; i < a.outputs.names.size(); ++i) {
    std::string name = a.outputs.names[i];
    if (name.size() > 2 && name[name.size() - 2] == '.') name.resize(name.size() - 2);
    auto& [difference, size] = outputs[name];
    const auto column = static_cast<Eigen::Index>(i);
    difference =
        std::max(difference, (a.outputs.values.col(column) - b.outputs.values.col(column)).cwiseAbs().maxCoeff());
    size = std::max(size, a.outputs.values.col(column).cwiseAbs().maxCoeff());
  }
  double most = 0;
  for (const auto& [name, sizes] : outputs) {
    constexpr double nothing = 1e-6;  // [m, rad, J, ...]: what an output must reach to be compared in digits
    const double error = sizes.first / std::max(sizes.second, nothing);
    if (error > most) most = error, worst = name;
  }
  return most;
}

/// Force and torque on the boom by Newton and Euler for the hub, which nothing else touches: by central differences of
/// its velocity and rate, axes of the boom. Error and size of both.
void expect_balance_of_the_hub(const RunResult& r, const std::string& name) {
  const Eigen::Matrix3d J{{0.10, 0.001, 0}, {0.001, 0.14, 0}, {0, 0, 0.06}};
  const Eigen::Vector3d point(0.1, 0.05, 0.15);
  const double mass = 8.5, h = column(r, "t")[1] - column(r, "t")[0];
  double force_error = 0, force_size = 0, torque_error = 0, torque_size = 0;
  for (Eigen::Index i = 2; i + 2 < r.outputs.values.rows(); ++i) {
    const auto slope = [&](const char* of) -> Eigen::Vector3d {
      return (8 * (vector_at(r, of, i + 1) - vector_at(r, of, i - 1)) - vector_at(r, of, i + 2) +
              vector_at(r, of, i - 2)) /
             (12 * h);
    };
    const Eigen::Vector3d turned = vector_at(r, "hub.rotation", i), omega = vector_at(r, "hub.rate", i);
    const Eigen::Matrix3d A =
        Eigen::AngleAxisd(turned.norm(), turned.norm() > 0 ? turned.normalized() : Eigen::Vector3d::UnitX())
            .toRotationMatrix();
    Eigen::Matrix3d C;  // boom at angle zero -> hub: stowed, outward, their product
    C << 0, 1, 0, 0, 0, -1, -1, 0, 0;
    C *= Eigen::AngleAxisd(column(r, "boom.angle")[i], Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Vector3d force = C * vector_at(r, "boom.force", i), torque = C * vector_at(r, "boom.torque", i);
    const Eigen::Vector3d on_hub = mass * A.transpose() * slope("hub.velocity");
    const Eigen::Vector3d moment = J * slope("hub.rate") + omega.cross(J * omega);
    force_error = std::max(force_error, (force + on_hub).norm());
    torque_error = std::max(torque_error, (torque + point.cross(force) + moment).norm());
    force_size = std::max(force_size, force.norm()), torque_size = std::max(torque_size, moment.norm());
  }
  // The modes of the boom on its hinge, up to 2500 rad/s, over steps of 2e-5 s: (omega h)^4 / 30 of what they do.
  EXPECT_LT(force_error, 1e-5 * force_size) << name;
  EXPECT_LT(torque_error, 1e-5 * torque_size) << name;
  EXPECT_GT(force_size, 1e-2) << name;
}

TEST(Combinations, LoadsOfAHingeBalanceTheHubInBothFormulations) {
  Scene scene = parse_scene(hub_with_a_boom, "loads");
  scene.hinges[0].loads = true;
  scene.duration = 0.02, scene.output_step = 2e-5, scene.tolerance = 1e-11;
  for (const char* formulation : {"relative", "multipliers"}) {
    scene.formulation = formulation;
    expect_balance_of_the_hub(run_scene(scene, {}), formulation);
  }
}

/// Report, budget, going on and the methods, of one scene in one formulation.
void expect_whole(Scene scene, const std::string& name, const std::filesystem::path& folder) {
  scene.duration = 0.04, scene.output_step = 0.01, scene.vtu_step = 0.02;
  const RunResult whole = run_scene(scene, {});
  {
    ResultsFolder results(folder / "results", scene, "");
    results.write(whole);
    const std::string page = report_html(folder / "results");
    EXPECT_NE(page.find("<canvas"), std::string::npos) << name << ": " << page.substr(0, 3000);
    EXPECT_TRUE(std::filesystem::exists(folder / "results" / "motion_00002.vtu")) << name;
  }
  std::string worst;
  Scene half = scene;
  half.duration = 0.02;
  const RunResult on = run_scene(going_on(scene, run_scene(half, {})), {});
  EXPECT_EQ(on.outputs.names, whole.outputs.names) << name;
  const Eigen::Index last = whole.outputs.values.rows() - 1;
  OutputTable end_of_whole{whole.outputs.names, whole.outputs.values.row(last)},
      end_of_both{on.outputs.names, on.outputs.values.bottomRows(1)};
  EXPECT_LT(largest(compare_outputs(end_of_both, end_of_whole, {})), 1e-5) << name;
  Scene measured = scene;
  measured.tolerance = 1e-5, measured.error_budget = true;
  const RunResult r = run_scene(measured, {});
  EXPECT_TRUE(r.budget.measured) << name;
  EXPECT_TRUE(r.budget.time < 1e-4) << name << ": " << r.budget.time;
  EXPECT_EQ(std::isnan(r.budget.total()), !r.budget.missing.empty()) << name;
  if (scene.formulation == "multipliers") return;  // by one method
  for (const IntegratorMethod& m : integrator_methods()) {
    scene.integrator = m.name;
    const double error = apart(run_scene(scene, {}), whole, worst);
    EXPECT_LT(error, 1e-5) << name << " by " << m.name << ": " << worst;
  }
}

TEST(SlowCombinations, EveryFeatureHasReportBudgetContinuationAndAllMethods) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("flexboom_outputs_" + std::to_string(::getpid()));
  const std::filesystem::path body_file = folder / "boom.h5";
  std::filesystem::create_directories(folder);
  BodyScene boom = scene_named("sport").bodies[0];
  boom.stiffening = "on";
  write_body_file(body_file, prepare_body(boom).body);
  for (const Feature& f : features(body_file))
    for (const char* formulation : {"relative", "multipliers"}) {
      const std::string name = std::string(f.name) + ", " + formulation;
      try {
        Scene scene = parse_scene(text_of({&f}), "combination");
        scene.bodies_kept_in = folder, scene.formulation = formulation;
        expect_whole(scene, name, folder);
      } catch (const std::exception& error) {
        ADD_FAILURE() << name << ": " << error.what();
      }
    }
  std::filesystem::remove_all(folder);
}

TEST(SlowCombinations, EveryPairOfFeaturesFliesAlikeInBothFormulations) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("flexboom_combinations_" + std::to_string(::getpid()));
  const std::filesystem::path body_file = folder / "boom.h5";
  std::filesystem::create_directories(folder);
  {
    BodyScene boom = scene_named("sport").bodies[0];
    boom.stiffening = "on";
    write_body_file(body_file, prepare_body(boom).body);
  }
  const std::vector<Feature> all = features(body_file);
  int flown = 0;
  double most = 0, between_methods = 0;
  for (size_t i = 0; i < all.size(); ++i)
    for (size_t k = i; k < all.size(); ++k) {
      std::vector<const Feature*> chosen = {&all[i]};
      if (k != i) chosen.push_back(&all[k]);
      const std::string name = k == i ? all[i].name : std::string(all[i].name) + " and " + all[k].name;
      const auto no = impossible.find({all[i].name, all[k].name});
      if (no != impossible.end() && no->second == nullptr) continue;
      try {
        Scene scene = parse_scene(text_of(chosen), "combination");
        scene.bodies_kept_in = folder;
        const RunResult relative = run_scene(scene, {});
        for (const char* method : {"exponential", "adams", "bdf"}) {
          std::string worst;
          Scene other = scene;
          other.integrator = method;
          // Its errors of the high modes are a hundred times what its steps are asked for.
          if (other.integrator == "bdf") other.tolerance /= 10;
          const RunResult by_method = run_scene(other, {});
          const double error = apart(relative, by_method, worst);
          EXPECT_LT(error, 1e-6) << name << " by " << method << ": " << worst;
          EXPECT_EQ(relative.motion.events.size(), by_method.motion.events.size()) << name << " by " << method;
          between_methods = std::max(between_methods, error);
        }
        scene.formulation = "multipliers", scene.integrator = "auto";
        validate(scene);
        const RunResult multipliers = run_scene(scene, {});
        std::string worst;
        const double error = apart(relative, multipliers, worst);
        EXPECT_LT(error, 1e-6) << name << ": " << worst;
        EXPECT_EQ(relative.motion.events.size(), multipliers.motion.events.size()) << name;
        EXPECT_LT(relative.motion.summary.energy_balance, 1e-6) << name;
        EXPECT_LT(multipliers.motion.summary.energy_balance, 1e-6) << name;
        EXPECT_EQ(no, impossible.end()) << name;
        ++flown, most = std::max(most, error);
      } catch (const std::exception& error) {
        if (no == impossible.end())
          ADD_FAILURE() << name << ": " << error.what();
        else
          EXPECT_NE(std::string(error.what()).find(no->second), std::string::npos) << name << ": " << error.what();
      }
    }
  std::filesystem::remove_all(folder);
  std::printf("%d scenes flown in both formulations, at most %.1e apart; by every method, at most %.1e\n", flown, most,
              between_methods);
}

}  // namespace
}  // namespace flexboom
