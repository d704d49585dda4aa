#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/exports/integrals.hpp"
#include "reduction/exports/sid.hpp"
#include "tests/reduction/export_testing.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace flexboom {
namespace {

using Eigen::MatrixXd;
using test::bent;

TEST(ExportSid, EveryDialectHoldsTheSameData) {
  ReducedBody body = bent();
  test::add_random_stiffening(body, 4);
  const auto path = test::test_folder() / "bent.SID_FEM";
  const ExportOptions other = {{{"m1", "row-column-mode"}, {"Oe", "xy-xz-yz"}, {"Ge", "component"}, {"J", "3x3"}}};
  const SidFile data = sid_file(body, {});
  for (const ExportOptions& options : {ExportOptions{}, other}) {
    write_sid(body, options, path);
    const SidFile file = read_sid(path, options);
    EXPECT_EQ(file.J.m1[2], data.J.m1[2]);
    EXPECT_EQ(file.Oe.m0, data.Oe.m0);
    EXPECT_EQ(file.Oe.m1[1], data.Oe.m1[1]);
    EXPECT_EQ(file.Ge.m0, data.Ge.m0);
    EXPECT_EQ(file.Gr.m0, data.Gr.m0);
    EXPECT_EQ(file.Ct.m1[3], data.Ct.m1[3]);
    EXPECT_EQ(file.Cr.m1[4], data.Cr.m1[4]);
    EXPECT_EQ(file.De.m0, data.De.m0);
    EXPECT_EQ(file.nodes[2].phi.m1[0], data.nodes[2].phi.m1[0]);
    EXPECT_EQ(file.nodes[2].AP.m1[5], data.nodes[2].AP.m1[5]);
    EXPECT_EQ(file.modes, data.modes);
    for (const BodyCheck& c : sid_identities(file)) EXPECT_TRUE(c.passed) << c.name;
  }
  // Read in the wrong dialect the data are others, and the identities say so.
  bool seen = false;
  for (const BodyCheck& c : sid_identities(read_sid(path, {{{"m1", "row-column-mode"}}}))) seen |= !c.passed;
  EXPECT_TRUE(seen);
}

TEST(ExportSid, IdentitiesSeeEveryWrongMatrix) {
  const SidFile good = sid_file(bent(), {});
  const std::pair<std::string, std::function<void(SidFile&)>> faults[] = {
      {"mdCM.m1 = Ct^T", [](SidFile& s) { s.mdCM.m1[0] *= -1; }},
      {"Ge = 2 skew Cr.m1", [](SidFile& s) { s.Ge.m0 *= -1; }},
      {"sym Gr = J.m1", [](SidFile& s) { s.J.m1[1](0, 1) *= -1; }},
      {"skew Gr = -tilde(Cr)", [](SidFile& s) { s.Gr.m0.leftCols<3>().transposeInPlace(); }},
      {"Oe = -J.m1 / 2, -J.m1", [](SidFile& s) { s.Oe.m0.col(4).swap(s.Oe.m0.col(5)); }},
      {"Ct^T Me^-1 Ct <= m", [](SidFile& s) { s.Me.m0 /= 100; }},
  };
  for (const BodyCheck& c : sid_identities(good)) EXPECT_TRUE(c.passed) << c.name << c.relative_error;
  for (const auto& [name, damage] : faults) {
    SidFile bad = good;
    damage(bad);
    bool seen = false;
    for (const BodyCheck& c : sid_identities(bad)) seen |= c.name == name && !c.passed;
    EXPECT_TRUE(seen) << name;
  }
}

TEST(ExportSid, LinesSuitTheOldestReader) {
  // EMBSlib's reader: exponents with D, at most 19 characters before it, lines of 511, indices of 5 digits.
  const auto path = test::test_folder() / "bent.SID_FEM";
  write_sid(bent(), {}, path);
  const std::string text = file_bytes(path);
  TextReader reader(text, "sid");
  const auto first = reader.next_line();
  EXPECT_EQ(trimmed(first->substr(0, 10)), "3    6");
  EXPECT_EQ(trimmed(*reader.next_line()), "part");
  int numbers = 0;
  while (const auto line = reader.next_line()) {
    EXPECT_LT(line->size(), 500U);
    const size_t equals = line->find('=');
    if (equals == std::string_view::npos || !trimmed(*line).starts_with('m')) continue;
    const std::string_view value = trimmed(line->substr(equals + 1));
    EXPECT_EQ(line->substr(0, equals).size(), 48U) << *line;
    EXPECT_NE(value.find('D'), std::string_view::npos) << *line;
    EXPECT_LE(value.find('D'), 19U) << *line;
    ++numbers;
  }
  EXPECT_GT(numbers, 500);
}

/// An entry as it stands in the text, 0 where it is not.
double entry(const std::string& text, const std::string& matrix, const std::string& place) {
  const size_t begin = text.find("\n           " + matrix + "\n");
  const size_t end = text.find("end " + matrix + "\n", begin);
  const size_t at = text.find(place + " ", begin);
  if (at == std::string::npos || at > end) return 0;
  const size_t equals = text.find('=', at);
  return to_real(trimmed(std::string_view(text).substr(equals + 1, text.find('\n', at) - equals - 1)), true).value();
}

TEST(ExportSid, DialectsAreInTheText) {
  const auto path = test::test_folder() / "bent.SID_FEM";
  const auto text_of = [&path](ExportOptions options) {
    options.settings["modal_mass"] = "as-is";
    write_sid(bent(), options, path);
    return file_bytes(path);
  };
  const std::string usual = text_of({});
  const std::string other =
      text_of({{{"m1", "row-column-mode"}, {"Oe", "xy-xz-yz"}, {"Ge", "component"}, {"J", "3x3"}}});
  const auto& Cr1 = bent().Cr1;
  const Eigen::Matrix3d W = RawIntegrals(bent(), "test").S_u0(3);
  EXPECT_EQ(entry(usual, "mdCM", "m1( 3, 5, 1)"), bent().Ct(2, 4));
  EXPECT_EQ(entry(other, "mdCM", "m1( 3, 1, 5)"), bent().Ct(2, 4));
  EXPECT_EQ(entry(usual, "Cr", "m1( 2, 5, 3)"), Cr1[4](2, 1));  // mode 2 of the row, d/dq_5, about z
  EXPECT_EQ(entry(other, "Cr", "m1( 2, 3, 5)"), Cr1[4](2, 1));
  EXPECT_EQ(entry(usual, "Ge", "m0( 2,15)"), 2 * Cr1[4](2, 1));  // 3 (5 - 1) + 3
  EXPECT_EQ(entry(other, "Ge", "m0( 2,17)"), 2 * Cr1[4](2, 1));  // 6 (3 - 1) + 5
  EXPECT_EQ(entry(usual, "Oe", "m0( 4, 5)"), W(1, 2) + W(2, 1));
  EXPECT_EQ(entry(other, "Oe", "m0( 4, 6)"), W(1, 2) + W(2, 1));
  EXPECT_EQ(entry(usual, "Oe", "m0( 4, 6)"), W(0, 2) + W(2, 0));
  EXPECT_EQ(entry(usual, "J", "m0( 5, 1)"), bent().J0(0, 2));
  EXPECT_EQ(entry(other, "J", "m0( 1, 3)"), bent().J0(0, 2));
  EXPECT_EQ(entry(usual, "Gr", "m0( 1, 5)"), -2 * RawIntegrals(bent(), "test").tilde_u0_tilde_S(1)(0, 1));
}

TEST(ExportSid, ReadsOtherWritersFiles) {
  // No first line, E exponents, a symmetric matrix by its lower triangle, as welib prints.
  const auto taylor = [](const std::string& name, int rows, int cols, int order, int structure,
                         const std::string& entries) {
    return name + "\n order = " + std::to_string(order) + "\n nrow = " + std::to_string(rows) +
           "\n ncol = " + std::to_string(cols) + "\n nq = 2\n nqn = 0\n structure = " + std::to_string(structure) +
           "\n" + entries + "end " + name + "\n";
  };
  std::string text =
      "part\nnew modal\nrefmod\n mass = 2.5\n nelastq = 2\n ielastq(1) = Eigen Mode 1\n ielastq(2) = x : 3.5 Hz\nend "
      "refmod\n";
  text += "new frame\nend frame\n" + taylor("mdCM", 3, 1, 1, 3, "m0( 2, 1) = 0.5E+01\nm1( 1, 1, 2) = 7\n");
  text += taylor("J", 3, 3, 1, 2, "m0( 1, 1) = 2\nm0( 2, 1) = -1\n") + taylor("Ct", 2, 3, 0, 3, "m0( 2, 3) = 4.D0\n");
  text += taylor("Cr", 2, 3, 1, 3, "") + taylor("Me", 2, 2, 0, 4, "") + taylor("Gr", 3, 6, 0, 3, "");
  text += taylor("Ge", 2, 6, 0, 3, "") + taylor("Oe", 2, 6, 1, 3, "m0( 1, 5) = 9\n") + taylor("ksigma", 2, 1, 0, 0, "");
  text += taylor("Ke", 2, 2, 0, 1, "m0( 2, 2) = 8\n") + taylor("De", 2, 2, 0, 0, "") + "end modal\nend part\n";
  const auto path = test::test_folder() / "other.sid";
  write_file(path, text);
  const SidFile sid = read_sid(path, {{{"m1", "row-column-mode"}, {"Oe", "xy-xz-yz"}}});
  EXPECT_EQ(sid.mass, 2.5);
  EXPECT_EQ(sid.modes[1], (std::pair<std::string, double>("x", 3.5)));
  EXPECT_EQ(sid.mdCM.m0(1), 5);
  EXPECT_EQ(sid.mdCM.m1[1](0), 7);
  EXPECT_EQ(sid.J.m0(0, 1), -1);
  EXPECT_EQ(sid.J.m0(1, 0), -1);
  EXPECT_EQ(sid.Ct.m0(1, 2), 4);
  EXPECT_EQ(sid.Me.m0, MatrixXd::Identity(2, 2));
  EXPECT_EQ(sid.Oe.m0(0, 5), 9);
}

}  // namespace
}  // namespace flexboom
