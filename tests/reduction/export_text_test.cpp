#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/exports/coupling.hpp"
#include "reduction/exports/integrals.hpp"
#include "reduction/exports/mbdyn.hpp"
#include "reduction/exports/nasa42.hpp"
#include "reduction/exports/sid.hpp"
#include "reduction/invariants/eq14.hpp"
#include "tests/reduction/export_testing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::bent;
using test::message;

std::filesystem::path path_of(const Exporter& e) {
  return test::test_folder() / (e.extension == "/" ? "bent" : "bent" + std::string(e.extension));
}

TEST(ExportText, EveryFormatIsReadBackAsTheSameBody) {
  ReducedBody body = bent();
  test::add_random_stiffening(body, 3);
  const ReducedBody boom = eq14::reduced_body({1.2, 0.3, 5.0}, 2, eq14::Planes::xy_and_xz, "boom");
  for (const Exporter& e : exporters()) {
    if (e.name == "simscape") continue;  // for bodies of frame "free" only: its own test
    // 17 digits lose nothing; what is left is the round-off of the comparison. EXUDYN has rotations of markers as
    // differences of displacements at the ends of short arms.
    const double limit = e.name == "exudyn" ? 1e-10 : 1e-12;
    for (const ReducedBody& b : {bent(), body, boom}) {
      const ExportReport report = export_body(b, e.name, {}, path_of(e));
      EXPECT_GE(report.checks.size(), 5 + (e.name == "matrix-market" ? 0 : b.markers.size())) << e.name;
      for (const BodyCheck& c : report.checks) {
        EXPECT_LT(c.relative_error, limit) << e.name << " " << c.name << " " << c.value << " " << c.reference;
      }
      EXPECT_FALSE(report.cannot_hold.empty()) << e.name;
    }
  }
}

TEST(ExportText, CheckOfAFileSeesEveryFault) {
  const auto path = test::test_folder() / "bent.fem";
  write_mbdyn(bent(), {}, path);
  const ReadBack good = mbdyn_read_back({}, path);
  const std::pair<std::string, std::function<void(ReadBack&)>> faults[] = {
      {"m", [](ReadBack& b) { b.m *= 1 + 1e-9; }},
      {"m c", [](ReadBack& b) { b.mc0(2) *= -1; }},
      {"J0", [](ReadBack& b) { b.J0(0, 1) *= -1; }},
      {"(2 pi f)^2", [](ReadBack& b) { b.Ke *= 1 + 1e-9; }},
      {"effective masses", [](ReadBack& b) { b.Cr0.row(1) *= -1; }},
      {"unit forces at marker tip", [](ReadBack& b) { b.markers[2].S_theta.swap(b.markers[2].S); }},
  };
  for (const auto& [name, damage] : faults) {
    ReadBack bad = good;
    damage(bad);
    bool seen = false;
    for (const BodyCheck& c : check_read_back(bent(), bad)) seen |= c.name == name && !c.passed;
    EXPECT_TRUE(seen) << name;
  }
}

TEST(ExportText, RigidBodiesAreWritten) {
  const Eigen::Matrix3d J = Eigen::Vector3d(2, 3, 4).asDiagonal();
  ReducedBody hub = rigid_body("hub", 8.5, {0.1, 0, 0}, J);
  hub.markers.push_back({"port", {0.1, 0.2, 0.3}, Eigen::Matrix3Xd(3, 0), Eigen::Matrix3Xd(3, 0)});
  for (const Exporter& e : exporters()) {
    if (e.name == "simscape" || e.name == "exudyn") continue;  // have blocks of their own for rigid bodies, and say so
    for (const BodyCheck& c : export_body(hub, e.name, {}, path_of(e)).checks)
      EXPECT_TRUE(c.passed) << e.name << c.name;
  }
}

TEST(ExportText, CoordinateTableIsBesideTheFile) {
  const auto folder = test::test_folder();
  export_body(bent(), "sid", {}, folder / "boom.SID_FEM");
  const std::string table = file_bytes(folder / "boom.coordinates.csv");
  EXPECT_EQ(table.find("index,kind,frequency_hz,interface,direction,Ct_x"), 0U);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 1 + bent().n());
  export_body(bent(), "42", {}, folder / "in" / "sip");
  EXPECT_EQ(file_bytes(folder / "in" / "sip" / "sip.coordinates.csv"), table);
}

TEST(ExportText, UnknownFormatsAndSettingsAreRefused) {
  const auto path = test::test_folder() / "bent.fem";
  const auto exported = [&](const std::string& format, const ExportOptions& options) {
    return message([&] { export_body(bent(), format, options, path); });
  };
  EXPECT_NE(exported("sidd", {}).find("there are \"coupling\""), std::string::npos);
  EXPECT_NE(exported("mbdyn", {{{"invariant", "yes"}}}).find("there are \"invariants\""), std::string::npos);
  EXPECT_NE(exported("mbdyn", {{{"invariants", "maybe"}}}).find("one of points|groups|no"), std::string::npos);
  EXPECT_NE(exported("mbdyn", {{{"invariants", "points|groups"}}}).find("one of points|groups|no"), std::string::npos);
  EXPECT_NE(exported("coupling", {{{"a", "b"}}}).find("none for this format"), std::string::npos);
  EXPECT_NE(exported("42", {{{"spring", "hard"}}}).find("must be a number"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(ExportText, BodiesThatAFormatCannotHoldAreRefused) {
  ReducedBody no_gram = bent();
  no_gram.gram.resize(0, 0);
  ReducedBody no_marker = bent();
  no_marker.markers.clear();
  ReducedBody free = bent();
  free.frame = "free";
  const auto path = test::test_folder() / "bent";
  for (const std::string format : {"42", "mbdyn", "sid"}) {
    EXPECT_NE(message([&] { export_body(no_gram, format, {}, path); }).find("no raw integrals"), std::string::npos);
  }
  EXPECT_NO_THROW(export_body(no_gram, "coupling", {}, path / "bent.json"));
  EXPECT_NE(message([&] { export_body(no_marker, "mbdyn", {}, path); }).find("no markers"), std::string::npos);
  EXPECT_NE(message([&] { export_body(free, "42", {}, path); }).find("clamped and mean-axis"), std::string::npos);
  EXPECT_NE(message([&] { export_body(bent(), "42", {}, path / std::string(30, 'x')); }).find("39"), std::string::npos);
}

TEST(ExportText, RawIntegralsAreTheInvariants) {
  const RawIntegrals raw(bent(), "test");
  for (Index k = 0; k < bent().n(); ++k) {
    const auto kk = static_cast<size_t>(k);
    const Eigen::Matrix3d A = raw.tilde_u0_tilde_S(k);
    EXPECT_LT((-(A + A.transpose()) - bent().J1[kk]).norm(), 1e-14 * bent().J1[kk].norm());
    for (Index l = 0; l < bent().n(); ++l) {
      const Eigen::Matrix3d B = raw.tilde_S_tilde_S(k, l);
      EXPECT_LT((-(B + B.transpose()) / 2 - bent().J2[kk][static_cast<size_t>(l)]).norm(), 1e-14);
    }
  }
}

TEST(ExportText, OtherCoordinatesAreTheSameBody) {
  test::Random random(11);
  const MatrixXd T = MatrixXd::Identity(bent().n(), bent().n()) + 0.3 * random.matrix(bent().n(), bent().n());
  const ReducedBody other = in_coordinates(bent(), T);
  other.validate();
  const auto back = [](const ReducedBody& b) { return ReadBack{b.m, b.mc0, b.J0, b.Ct, b.Cr0, b.Me, b.Ke, b.markers}; };
  for (const BodyCheck& c : check_read_back(bent(), back(other), 1e-11)) EXPECT_TRUE(c.passed) << c.name;
  const ReducedBody modal = with_unit_modal_mass(other);
  EXPECT_EQ(modal.Me, MatrixXd::Identity(bent().n(), bent().n()));
  for (const BodyCheck& c : check_read_back(bent(), back(modal), 1e-11)) EXPECT_TRUE(c.passed) << c.name;
  for (Index k = 0; k < bent().n(); ++k) {
    const auto kk = static_cast<size_t>(k);
    EXPECT_NEAR(modal.coordinates[kk].frequency_hz / bent().coordinates[kk].frequency_hz, 1, 1e-11);
  }
}

/// Coordinates that are modes but for round-off, or the reverse of some, keep their signs.
TEST(ExportText, ModalCoordinatesKeepTheSignsOfTheirOwn) {
  test::Random random(12);
  const Index n = bent().n();
  for (const double share : {1e-9, 0.1}) {
    const Eigen::VectorXd signs = random.matrix(n, 1);
    const MatrixXd T = MatrixXd(signs.cwiseSign().asDiagonal()) + share * random.matrix(n, n);
    const ReducedBody modal = with_unit_modal_mass(in_coordinates(bent(), T));
    const MatrixXd turned = modal_coordinates(in_coordinates(bent(), T)).T;
    for (Index k = 0; k < n; ++k) {
      EXPECT_GT(turned(k, k), 0);
      EXPECT_GT(modal.Ct.col(k).dot(bent().Ct.col(k)) * signs[k], 0) << k;
    }
  }
}

TEST(ExportMbdyn, FileHoldsWhatItSays) {
  const auto path = test::test_folder() / "bent.fem";
  const ExportOptions groups{{{"invariants", "groups"}}};
  write_mbdyn(bent(), groups, path);
  const MbdynFile data = mbdyn_file(bent(), groups);
  const MbdynFile file = read_mbdyn(path);
  EXPECT_EQ(file.labels, (std::vector<std::string>{"middle", "root", "tip"}));
  EXPECT_EQ(file.damping, data.damping);
  EXPECT_EQ(file.Inv9, data.Inv9);
  EXPECT_EQ(file.shapes[2], data.shapes[2]);
  const ExportReport report = export_body(bent(), "mbdyn", {{{"invariants", "no"}}}, path);
  for (const BodyCheck& c : report.checks) EXPECT_TRUE(c.passed) << c.name;
  EXPECT_EQ(file_bytes(path).find("GROUP 14"), std::string::npos);
  EXPECT_EQ(read_mbdyn(path).Inv3.size(), 0);
  std::filesystem::path modal = path;
  const std::string joint = file_bytes(modal.replace_extension(".modal"));
  EXPECT_NE(joint.find("joint: JOINT_bent_body, modal, MODAL_bent_body,\n  6,  # modes"), std::string::npos);
  EXPECT_NE(joint.find("  \"bent.fem\",\n  3,\n"), std::string::npos);
  EXPECT_NE(joint.find("  \"middle\", NODE_bent_body_middle, null,\n"), std::string::npos);
  EXPECT_NE(joint.find("  \"tip\", NODE_bent_body_tip, null;\n"), std::string::npos);
}

TEST(ExportMbdyn, MassPointsAreNodesBehindTheMarkers) {
  const auto path = test::test_folder() / "bent.fem";
  const ExportReport report = export_body(bent(), "mbdyn", {}, path);
  for (const BodyCheck& c : report.checks) EXPECT_TRUE(c.passed) << c.name;
  const MbdynFile file = read_mbdyn(path);
  ASSERT_EQ(file.masses.size(), file.labels.size());
  EXPECT_EQ(file.labels[2], "tip");
  EXPECT_EQ(file.labels[3], "mass_1");
  EXPECT_EQ(file.masses[2], 0);
  const std::string text = file_bytes(path);
  EXPECT_EQ(text.find("GROUP 14"), std::string::npos);  // MBDyn 1.7.3 knows groups 1 to 13
  EXPECT_EQ(text.find("GROUP 19"), std::string::npos);
  std::filesystem::path modal = path;
  const std::string joint = file_bytes(modal.replace_extension(".modal"));
  EXPECT_NE(joint.find("  \"bent.fem\",\n  3,\n"), std::string::npos);
  EXPECT_NE(joint.find("  \"tip\", NODE_bent_body_tip, null,\n  use invariant 9;\n"), std::string::npos);
  EXPECT_EQ(joint.find("mass_1"), std::string::npos);
}

TEST(ExportMbdyn, FaultsNameTheirLine) {
  const auto path = test::test_folder() / "bent.fem";
  write_mbdyn(bent(), {{{"invariants", "groups"}}}, path);
  const std::string good = file_bytes(path);
  const auto message_of = [&](const std::string& from, const std::string& to) {
    std::string bad = good;
    bad.replace(bad.find(from), from.size(), to);
    write_file(path, bad);
    return message([&] { read_mbdyn(path); });
  };
  EXPECT_NE(message_of("REV0 3 6", "REV0 3 7").find("record group 8 has 108 values, must have 126"), std::string::npos);
  EXPECT_NE(message_of("REV0 3 6", "REV0 3 600000").find("bent.fem:5"), std::string::npos);
  EXPECT_NE(message_of("** RECORD GROUP 12", "** RECORD GROUP 112").find("record group 12 is missing"),
            std::string::npos);
  EXPECT_NE(message_of("middle\n", "middle\nmore\n").find("bent.fem:8"), std::string::npos);
}

TEST(ExportCoupling, FileHoldsFrequenciesDampingAndParticipation) {
  ReducedBody body = eq14::reduced_body({1.2, 0.3, 5.0}, 3, eq14::Planes::xy, "boom");
  apply_damping(body, {"modal", 0.05});
  const auto path = test::test_folder() / "boom.json";
  EXPECT_EQ(export_body(body, "coupling", {}, path).cannot_hold.size(), 2U);
  const CouplingFile file = read_coupling(path);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(file.omega(k) / eq14::omega({1.2, 0.3, 5.0}, k + 1), 1, 1e-14);
    EXPECT_NEAR(file.zeta(k), 0.05, 1e-15);
    // Unit modal mass: shape phi / sqrt(m), participation sqrt(m) 2 sigma / alpha.
    const double sign = k % 2 == 0 ? 1 : -1;
    EXPECT_NEAR(file.L_P(1, k), sign * std::sqrt(0.36) * eq14::integral_phi(k + 1), 1e-15);
    EXPECT_NEAR(file.L_P(5, k), sign * std::sqrt(0.36) * 1.2 * eq14::integral_x_phi(k + 1), 1e-15);
  }
  EXPECT_NE(file_bytes(path.parent_path() / "boom.modes.csv").find("\n2,bending_y,"), std::string::npos);
  EXPECT_NE(file_bytes(path.parent_path() / "boom.rigid.csv").find("\nJ_xy,0\n"), std::string::npos);
  EXPECT_EQ(coupling_cannot_hold(bent()).size(), 2U);  // Rayleigh damping is diagonal in the modes
  body.frame = "free";
  EXPECT_EQ(coupling_cannot_hold(body).size(), 3U) << "rigid motions are there twice";
}

TEST(ExportCoupling, FaultsNameTheFile) {
  const auto path = test::test_folder() / "bad.json";
  for (const char* text : {"{", "[]", "{\"format\": \"x\"}", "{\"format\": \"flexboom-coupling-1\", \"body\": 3}"}) {
    write_file(path, text);
    EXPECT_NE(message([&] { read_coupling(path); }).find("bad.json"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace flexboom
