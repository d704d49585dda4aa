#include "dynamics/methods/ode.hpp"
#include "dynamics/model/hub_with_booms.hpp"
#include "tree_testing.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

// Counts every allocation of this program by standing in front of glibc's malloc; sanitizers have their own malloc.
#if defined(__SANITIZE_ADDRESS__)
#define FLEXBOOM_HAS_SANITIZERS 1
#elif defined(__has_feature)
#define FLEXBOOM_HAS_SANITIZERS __has_feature(address_sanitizer)
#else
#define FLEXBOOM_HAS_SANITIZERS 0
#endif
#if defined(__GLIBC__) && !FLEXBOOM_HAS_SANITIZERS

namespace {
std::atomic<long> allocations{0};
}

extern "C" void* __libc_malloc(std::size_t);
extern "C" void* malloc(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}

namespace flexboom {
namespace {

TEST(Allocation, IsCounted) {
  const long before = allocations;
  const std::vector<double> v(1000, 1.0);
  EXPECT_GT(allocations - before, 0) << v.size();
}

TEST(Allocation, RightHandSideJacobianAndNewtonSolveMakeNone) {
  Appendage a{eq14::reduced_body(testing::round_boom(0.295, 0.005), 3, eq14::Planes::xy_and_xz, "boom"), {}};
  a.hinge.mechanism = testing::sport_mechanism(0.35);
  const Tree tree(hub_with_booms(rigid_body("hub", 8.5, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()), {a, a}));
  const Laws no_laws;
  const std::unique_ptr<Ode> ode = ode_of(tree, no_laws);
  const Eigen::VectorXd y = tree.pack(tree.at_rest());
  Eigen::VectorXd y_dot(y.size());
  const std::vector<char> contact = {0, 1};
  long before = 0;
  for (int i = 0; i < 10; ++i) {
    if (i == 1) before = allocations;  // the first makes room
    ode->derivative(0, y.data(), contact, y_dot.data());
    ode->jacobian(0, y.data(), contact);
    ode->factorise(1e-3);
    ode->solve(y_dot.data(), y_dot.data());
  }
  EXPECT_EQ(allocations - before, 0);
}

TEST(Allocation, RightHandSideOfATreeMakesNone) {
  std::mt19937 random(1);
  Multibody scene;
  for (int i = 0; i < 4; ++i) {
    scene.bodies.push_back(eq14::reduced_body(testing::round_boom(0.295, 0.005), 3, eq14::Planes::xy_and_xz, "boom"));
    scene.joints.push_back(testing::joint("joint", i == 0 ? JointKind::free : JointKind::hinge,
                                          i == 0 ? testing::place(-1) : testing::at_marker(i - 1, "tip"),
                                          i == 3 ? testing::at_marker(3, "tip") : testing::place(i)));
    scene.bodies.back().J0(0, 0) += 1e-4;
  }
  scene.joints[1].prescribed.push_back(testing::swing(1));
  scene.loads.push_back({"push", testing::at_marker(2, "tip"), true, {[](double t) { return t; }, {}, {}}, {}});
  const Tree tree(scene);
  const auto work = tree.workspace();
  const Eigen::VectorXd y = tree.pack(testing::random_state(tree, random));
  Eigen::VectorXd y_dot(y.size());
  const std::vector<char> contact(4, 0);
  const long before = allocations;
  for (int i = 0; i < 10; ++i) tree.derivative(0.1 * i, y.data(), contact, *work, y_dot.data());
  EXPECT_EQ(allocations - before, 0);
}

}  // namespace
}  // namespace flexboom

#endif
