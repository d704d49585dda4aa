#include "apps/model/body_text.hpp"

#include "reduction/invariants/root_loads.hpp"

#include <fmt/format.h>

namespace flexboom {

namespace {

/// omega_k^2 (Ct_k; Cr0_k): what each coordinate brings to the root when it vibrates. Empty without frequencies.
std::string root_load_table(const ReducedBody& body) {
  const Eigen::MatrixXd L = root_load_participation(body);
  if (L.size() == 0 || L.isZero(0)) return "";
  std::string text = fmt::format("root loads per unit of a coordinate that vibrates, omega^2 (Ct; Cr0)\n{:>4}", "q");
  for (const char* name : {"Fx N", "Fy N", "Fz N", "Mx N m", "My N m", "Mz N m"}) text += fmt::format(" {:>12}", name);
  text += "\n";
  for (int k = 0; k < body.n(); ++k) {
    text += fmt::format("{:4}", k + 1);
    for (int i = 0; i < 6; ++i) text += fmt::format(" {:12.4e}", L(i, k));
    text += "\n";
  }
  return text;
}

}  // namespace

std::string description(const ReducedBody& body, const std::vector<BodyCheck>& checks) {
  const Eigen::Vector3d centre = body.mc0 / body.m;
  std::string text = fmt::format("{}: {}, {} coordinates of {} freedoms, frame {}\n", body.name, body.structure,
                                 body.n(), body.full_freedoms, body.frame);
  text += fmt::format("mass {:.12g} kg, centre {:.9g} {:.9g} {:.9g} m\n", body.m, centre.x(), centre.y(), centre.z());
  text += fmt::format("inertia about the origin: xx {:.9g} yy {:.9g} zz {:.9g} xy {:.9g} yz {:.9g} zx {:.9g} kg m^2\n",
                      body.J0(0, 0), body.J0(1, 1), body.J0(2, 2), body.J0(0, 1), body.J0(1, 2), body.J0(2, 0));
  text += fmt::format(
      "geometric stiffness: {}\n",
      body.Kg.spin.empty() ? "none" : fmt::format("spin, acceleration, {} marker(s)", body.Kg.markers.size()));
  for (const Marker& m : body.markers)
    text +=
        fmt::format("marker {} at {:.9g} {:.9g} {:.9g} m\n", m.name, m.position.x(), m.position.y(), m.position.z());
  text += fmt::format("{:>4} {:<12} {:>16} {:<12} {:<4} {:>12} {:>12} {:>12}\n", "q", "kind", "Hz", "interface", "",
                      "Ct x", "Ct y", "Ct z");
  for (int k = 0; k < body.n(); ++k) {
    const Coordinate& c = body.coordinates[static_cast<size_t>(k)];
    text += fmt::format("{:4} {:<12} {:16.8f} {:<12} {:<4} {:12.4e} {:12.4e} {:12.4e}\n", k + 1, c.kind, c.frequency_hz,
                        c.interface, c.direction, body.Ct(0, k), body.Ct(1, k), body.Ct(2, k));
  }
  text += root_load_table(body);
  text += fmt::format("{:<58} {:>22} {:>22} {:>10}\n", "check", "value", "reference", "error");
  return text + checks_text(checks);
}

std::string checks_text(const std::vector<BodyCheck>& checks) {
  std::string text;
  for (const BodyCheck& c : checks)
    text += fmt::format("{:<58} {:22.14g} {:22.14g} {:10.1e}{}\n", c.name, c.value, c.reference, c.relative_error,
                        c.passed ? "" : "  FAILED");
  return text;
}

nlohmann::ordered_json checks_json(const std::vector<BodyCheck>& checks) {
  auto list = nlohmann::ordered_json::array();
  for (const BodyCheck& c : checks)
    list.push_back({{"name", c.name},
                    {"value", c.value},
                    {"reference", c.reference},
                    {"relative_error", c.relative_error},
                    {"passed", c.passed}});
  return list;
}

nlohmann::ordered_json seconds_json(const ReductionSeconds& s) {
  return {{"mesh", s.mesh},
          {"assemble", s.assemble},
          {"modes", s.modes},
          {"invariants", s.invariants},
          {"stiffening", s.stiffening},
          {"certificate", s.certificate},
          {"richer", s.richer},
          {"total", s.total}};
}

nlohmann::ordered_json body_json(const ReducedBody& body, const std::vector<BodyCheck>& checks,
                                 const std::vector<std::string>& notes) {
  const Eigen::MatrixXd L = root_load_participation(body);  // 6 x n
  auto coordinates = nlohmann::ordered_json::array();
  for (int k = 0; k < body.n(); ++k) {
    const Coordinate& c = body.coordinates[static_cast<size_t>(k)];
    coordinates.push_back({{"kind", c.kind},
                           {"frequency_hz", c.frequency_hz},
                           {"interface", c.interface},
                           {"direction", c.direction},
                           {"root_loads", std::vector<double>(L.col(k).begin(), L.col(k).end())}});
  }
  auto markers = nlohmann::ordered_json::array();
  for (const Marker& m : body.markers)
    markers.push_back({{"name", m.name}, {"position", std::vector<double>(m.position.begin(), m.position.end())}});
  const Eigen::Vector3d centre = body.mc0 / body.m;
  auto inertia = nlohmann::ordered_json::array();
  for (int i = 0; i < 3; ++i) inertia.push_back({body.J0(i, 0), body.J0(i, 1), body.J0(i, 2)});
  const Provenance& p = body.provenance;
  return {{"name", body.name},
          {"structure", body.structure},
          {"frame", body.frame},
          {"mass", body.m},
          {"centre", std::vector<double>(centre.begin(), centre.end())},
          {"inertia", inertia},
          {"dofs", body.full_freedoms},
          {"coordinates", coordinates},
          {"markers", markers},
          {"stiffening", !body.Kg.spin.empty()},
          {"checks", checks_json(checks)},
          {"provenance",
           {{"program", p.program},
            {"libraries", p.libraries},
            {"source", p.source},
            {"mesh_hash", p.mesh_hash},
            {"options", p.options},
            {"doubts", p.doubts}}},
          {"notes", notes}};
}

}  // namespace flexboom
