// Walks through every installed library once: a boom as beams, its modes, its reduced body, and a short flight on a
// hub.
#include <dynamics/model/hub_with_booms.hpp>
#include <dynamics/simulation/tree_integrator.hpp>
#include <fem/booms/boom.hpp>
#include <reduction/invariants/eq14.hpp>
#include <reduction/invariants/inertia_invariants.hpp>

#include <cmath>
#include <iostream>
#include <numbers>

int main() {
  using namespace flexboom;

  const double length = 0.3;
  const Material material{67e9, 0.33, 2840};
  BeamSegment segment;
  segment.start = segment.end = RoundBar{0.005};
  segment.length = length;
  segment.material = material;
  BeamGeometry geometry;
  geometry.segments = {segment};
  geometry.theory = BeamTheory::euler_bernoulli;
  geometry.rotary_inertia = false;

  const Mesh mesh = make_mesh(geometry);
  const Assembly assembly = assemble(mesh);
  const ModalBasis basis = clamped_modes(mesh, assembly, node_set(mesh, "root"), EigenOptions{});
  const ReducedBody boom = reduce(mesh, assembly, basis, "boom");

  const Section section = section_of(segment.start, material.nu, geometry.shear);
  const double omega = eq14::omega({length, material.rho * section.A, material.E * section.Iz}, 1);
  const double error = std::abs(basis.omega(0) / omega - 1);
  std::cout << "first frequency against eq. 14: relative error " << error << '\n';

  const ReducedBody hub = rigid_body("hub", 8.5, Eigen::Vector3d::Zero(), 0.1 * Eigen::Matrix3d::Identity());
  Hinge hinge;
  hinge.mechanism.stiffness = 0.2;
  hinge.mechanism.damping = 0.01;
  const Tree satellite(hub_with_booms(hub, {{boom, hinge}}));
  TreeState start = satellite.at_rest();
  start.joints[1].coordinate = {std::numbers::pi / 2 - 0.05};
  IntegratorOptions options;
  options.duration = 0.1;
  const TreeTrajectory motion = integrate(satellite, satellite.pack(start), options);
  std::cout << "flight of " << motion.time.back() << " s: energy balance " << motion.summary.energy_balance << '\n';

  const bool passed =
      error < 1e-6 && motion.summary.energy_balance < 1e-3;  // linked and alive; accuracy has its own tests
  return passed ? 0 : 1;
}
