#include "dynamics/redundant/joint.hpp"

#include <algorithm>

namespace flexboom::redundant {
namespace {

using Kind = Row::Kind;
using Drive = Row::Drive;

constexpr Vec3<double> X{1, 0, 0}, Y{0, 1, 0}, Z{0, 0, 1};

/// What each kind of joint holds, and what a prescribed freedom adds.
struct KindRows {
  JointKind kind;
  std::vector<Row> held, driven;
};

Row along(const Vec3<double>& e, const char* what) { return {.kind = Kind::along, .e = e, .f = {}, .what = what}; }
Row across(const Vec3<double>& e, const Vec3<double>& f, const char* what) {
  return {.kind = Kind::across, .e = e, .f = f, .what = what};
}
Row driven(Row row, Drive drive, size_t freedom) {
  row.drive = drive;
  row.freedom = freedom;
  return row;
}

const std::vector<KindRows>& table() {
  static const std::vector<KindRows> rows = [] {
    const Row px = along(X, "position along x"), py = along(Y, "position along y"), pz = along(Z, "position along z");
    const Row xz = across(X, Z, "tilt about y"), yz = across(Y, Z, "tilt about x"), yx = across(Y, X, "turn about z");
    return std::vector<KindRows>{{JointKind::fixed, {px, py, pz, xz, yz, yx}, {}},
                                 {JointKind::hinge, {px, py, pz, xz, yz}, {driven(yx, Drive::turn_e, 0)}},
                                 {JointKind::slider, {px, py, xz, yz, yx}, {driven(pz, Drive::shift, 0)}},
                                 {JointKind::universal,
                                  {px, py, pz, across(Z, Y, "axes normal to each other")},
                                  {driven(across(X, Y, "turn about z"), Drive::turn_e, 0),
                                   driven(across(Z, X, "turn about y"), Drive::turn_f, 1)}},
                                 {JointKind::spherical, {px, py, pz}, {}},
                                 {JointKind::free, {}, {}}};
  }();
  return rows;
}

}  // namespace

std::vector<Row> joint_rows(const Joint& joint) {
  const KindRows& k = *std::ranges::find(table(), joint.kind, &KindRows::kind);
  std::vector<Row> rows = k.held;
  if (joint.law.given() && LawModel(joint).can_hold()) {
    rows.push_back(k.driven.front());
    rows.back().holds = true;
  }
  if (!joint.prescribed.empty()) rows.insert(rows.end(), k.driven.begin(), k.driven.end());
  return rows;
}

}  // namespace flexboom::redundant
