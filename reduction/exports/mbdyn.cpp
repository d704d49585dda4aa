#include "reduction/exports/mbdyn.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "reduction/body/mass_points.hpp"
#include "reduction/body/tilde.hpp"
#include "reduction/exports/integrals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr ExportSetting settings_of_mbdyn[] = {
    {"invariants", "points|groups|no",
     "as mass points (record group 11), which every MBDyn sums up; as record groups 14 to 18, at which 1.7.3 stops"},
    {"stiffening", "no|yes", "record group 19, for an MBDyn that reads it: the public sources up to 2022 stop at it"},
};

/// That label, with underscores behind it while it is taken.
std::string unused_label(std::string label, std::set<std::string>& used) {
  while (!used.insert(label).second) label += '_';
  return label;
}

void set_invariants_3_to_9(MbdynFile& file, const ReducedBody& body) {
  const Index n = body.n();
  const RawIntegrals raw(body, "mbdyn");
  file.Inv3 = body.Ct;
  file.Inv4 = body.Cr0;
  file.Inv8.resize(3, 3 * n);
  file.Inv5.resize(3, n * n);
  file.Inv9.resize(3, 3 * n * n);
  for (Index j = 0; j < n; ++j) {
    file.Inv8.middleCols<3>(3 * j) = -raw.tilde_u0_tilde_S(j);
    file.Inv5.middleCols(n * j, n) = body.Cr1[static_cast<size_t>(j)];
    for (Index k = 0; k < n; ++k) file.Inv9.middleCols<3>(3 * (n * j + k)) = raw.tilde_S_tilde_S(j, k);
  }
}

/// Nodes behind the markers, no points of the body, whose masses have its integrals.
void add_mass_points(MbdynFile& file, const ReducedBody& body, std::set<std::string>& used) {
  const RawIntegrals must_exist(body, "mbdyn");
  const MassPoints points = mass_points(body.gram);
  const Index first = file.positions.cols();
  const Index count = points.z.cols();
  file.masses.assign(static_cast<size_t>(first), 0);
  file.positions.conservativeResize(3, first + count);
  file.positions.rightCols(count) = points.z.middleRows<3>(1);
  for (Index i = 0; i < count; ++i) {
    file.labels.push_back(unused_label(fmt::format("mass_{}", i + 1), used));
    file.masses.push_back(points.m);
    MatrixXd shape = MatrixXd::Zero(6, body.n());
    shape.topRows<3>() = points.z.col(i).tail(3 * body.n()).reshaped(3, body.n());
    file.shapes.push_back(shape);
  }
}

void set_stiffening(MbdynFile& file, const ReducedBody& body) {
  const auto add = [&file](int first, const std::vector<MatrixXd>& family) {
    for (size_t i = 0; i < family.size(); ++i) file.stiffening[first + static_cast<int>(i)] = family[i];
  };
  add(1, body.Kg.spin);
  add(7, body.Kg.angular_acceleration);
  add(10, body.Kg.acceleration);
  for (size_t i = 0; i < body.markers.size(); ++i) {
    for (const MarkerStiffness& m : body.Kg.markers) {
      if (m.marker != body.markers[i].name) continue;
      add(13 + 6 * static_cast<int>(i), m.force);
      add(16 + 6 * static_cast<int>(i), m.torque);
    }
  }
}

/// Text of a file, record group by record group.
class MbdynWriter {
 public:
  void group(int number, std::string_view title) { line(fmt::format("**\n** RECORD GROUP {}, {}", number, title)); }
  void line(std::string_view text) { (text_ += text) += '\n'; }

  void rows(const MatrixXd& A) {
    for (Index i = 0; i < A.rows(); ++i) {
      for (Index j = 0; j < A.cols(); ++j) fmt::format_to(std::back_inserter(text_), "{: .16e} ", A(i, j));
      text_ += '\n';
    }
  }

  void matrix(int number, std::string_view title, const MatrixXd& A) {
    group(number, title);
    rows(A);
  }

  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

std::string text_of(const MbdynFile& file, const ReducedBody& body) {
  const Index n = file.mass.rows();
  MbdynWriter w;
  w.line(fmt::format("** {}: reduced body of {}, SI units, axes and origin of the modal node", plain_name(body.name),
                     body.provenance.program.empty() ? "flexboom" : body.provenance.program));
  w.group(1, "HEADER");
  w.line("**   REVISION,  NODE,  NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES.");
  w.line(fmt::format("      REV0 {} {} 0 0 0", file.labels.size(), n));
  w.group(2, "FINITE ELEMENT NODE LIST");
  w.line(fmt::format("{}", fmt::join(file.labels, "\n")));
  w.matrix(3, "INITIAL MODAL DISPLACEMENTS", MatrixXd::Zero(1, n));
  w.matrix(4, "INITIAL MODAL VELOCITIES", MatrixXd::Zero(1, n));
  for (int i = 0; i < 3; ++i) {
    w.matrix(5 + i, fmt::format("NODAL {} COORDINATES", "XYZ"[i]), file.positions.row(i).transpose());
  }
  w.group(8, "NON-ORTHOGONALIZED MODE SHAPES");
  for (Index k = 0; k < n; ++k) {
    const Coordinate& c = body.coordinates[static_cast<size_t>(k)];
    w.line(fmt::format("**    NORMAL MODE SHAPE #  {}: {} {:.6g} Hz", k + 1, c.kind, c.frequency_hz));
    for (const MatrixXd& shape : file.shapes) w.rows(shape.col(k).transpose());
  }
  w.matrix(9, "MODAL MASS MATRIX. COLUMN-MAJOR FORM", file.mass);
  w.matrix(10, "MODAL STIFFNESS MATRIX. COLUMN-MAJOR FORM", file.stiffness);
  if (!file.masses.empty()) {
    w.group(11, "DIAGONAL OF LUMPED MASS MATRIX");
    for (const double m : file.masses) w.rows((Eigen::RowVectorXd(6) << m, m, m, 0, 0, 0).finished());
  }
  w.group(12, "GLOBAL INERTIA PROPERTIES");
  w.rows(MatrixXd::Constant(1, 1, file.m));
  w.rows(file.centre.transpose());
  w.rows(file.inertia);
  w.matrix(13, "MODAL DAMPING MATRIX. COLUMN-MAJOR FORM", file.damping.transpose());
  if (file.Inv3.cols() > 0) {
    w.matrix(14, "INVARIANT 3", file.Inv3);
    w.matrix(15, "INVARIANT 4", file.Inv4);
    w.matrix(16, "INVARIANT 8", file.Inv8);
    w.matrix(17, "INVARIANT 5", file.Inv5);
    w.matrix(18, "INVARIANT 9", file.Inv9);
  }
  if (!file.stiffening.empty()) {
    w.group(19, "MODAL STRESS STIFFENING MATRIX");
    w.line(fmt::format("{}", file.stiffening.size()));
    for (const auto& [index, K] : file.stiffening) {
      w.line(fmt::format("{}", index));
      w.rows(K);
    }
  }
  w.line("** END OF FILE");
  return w.text();
}

/// A name of MBDyn's mathematical parser.
std::string identifier(std::string_view name) {
  std::string result = plain_name(name);
  for (char& c : result) {
    if (c == '-' || c == '.' || c == '+') c = '_';
  }
  return result;
}

/// Nodes and joint that use the file, to be completed.
std::string template_of(const MbdynFile& file, const std::string& name, const std::string& fem_file) {
  const std::string body = identifier(name);
  const size_t points =
      file.masses.empty() ? 0 : file.masses.size() - static_cast<size_t>(std::ranges::count(file.masses, 0));
  const size_t markers = file.labels.size() - points;
  std::string text = fmt::format(
      "# Template for MBDyn: nodes and joint of the flexible body \"{0}\". The frame of its modal node is the body's.\n"
      "# To be completed: integers JOINT_{0}, MODAL_{0} and one NODE_... per interface node; these are static\n"
      "# structural nodes at the positions below, which a hinge joins to other bodies. A hinge with a stop is a\n"
      "# deformable hinge with the law `double linear elastic, STIFFNESS_1, UPPER, LOWER, STIFFNESS_2`.\n"
      "#\n"
      "# structural: MODAL_{0}, modal, POSITION, ORIENTATION, VELOCITY, ANGULAR_VELOCITY;\n\n"
      "joint: JOINT_{0}, modal, MODAL_{0},\n"
      "  {1},  # modes\n"
      "  from file,\n"
      "  damping from file,\n"
      "  \"{2}\",\n"
      "  {3}",
      body, file.mass.rows(), fem_file, markers);
  for (size_t i = 0; i < markers; ++i) {
    const Eigen::Vector3d r = file.positions.col(static_cast<Index>(i));
    fmt::format_to(std::back_inserter(text), ",\n  # at {2:.17g}, {3:.17g}, {4:.17g} m\n  \"{0}\", NODE_{1}, null",
                   file.labels[i], identifier(name + "_" + file.labels[i]), r.x(), r.y(), r.z());
  }
  if (!file.masses.empty()) text += ",\n  use invariant 9";  // the second order of the inertia in the coordinates
  return text + ";\n";
}

}  // namespace

std::span<const ExportSetting> mbdyn_settings() { return settings_of_mbdyn; }

MbdynFile mbdyn_file(const ReducedBody& body, const ExportOptions& options) {
  require(!body.markers.empty(), fmt::format("body \"{}\" has no markers: an MBDyn file needs one node or more, to "
                                             "which other bodies are joined",
                                             body.name));
  const std::string invariants = setting(settings_of_mbdyn, options, "invariants");
  const bool stiffening = setting(settings_of_mbdyn, options, "stiffening") == "yes";
  MbdynFile file;
  file.positions.resize(3, static_cast<Index>(body.markers.size()));
  std::set<std::string> used;
  for (size_t i = 0; i < body.markers.size(); ++i) {
    const Marker& m = body.markers[i];
    file.labels.push_back(unused_label(plain_name(m.name), used));
    file.positions.col(static_cast<Index>(i)) = m.position;
    MatrixXd shape(6, body.n());
    shape << m.S, m.S_theta;
    file.shapes.push_back(shape);
  }
  file.mass = body.Me;
  file.stiffness = body.Ke;
  file.damping = body.De;
  file.m = body.m;
  file.centre = body.mc0 / body.m;
  file.inertia = body.J0 - centre_inertia(body.m, body.mc0);
  if (body.n() == 0) return file;
  if (invariants == "points") add_mass_points(file, body, used);
  if (invariants == "groups") set_invariants_3_to_9(file, body);
  if (stiffening) set_stiffening(file, body);
  return file;
}

void write_mbdyn(const ReducedBody& body, const ExportOptions& options, const std::filesystem::path& path) {
  const MbdynFile file = mbdyn_file(body, options);
  write_file(path, text_of(file, body));
  std::filesystem::path joint = path;
  write_file(joint.replace_extension(".modal"), template_of(file, body.name, path.filename().string()));
}

std::vector<std::string> mbdyn_cannot_hold(const ReducedBody& body) {
  std::vector<std::string> sentences;
  if (body.n() > 0) {
    sentences.emplace_back(
        "Geometric stiffness is in record group 19 (stiffening = yes), at which MBDyn 1.7.3 and its development "
        "version "
        "of 2022 stop; without it the body softens under spin. With invariants = no nothing couples modes and rigid "
        "motion.");
  }
  if (body.frame == "free") {
    sentences.emplace_back("The coordinates hold rigid motions, which the modal node has as well: clamp the body.");
  }
  sentences.emplace_back(
      "The hinge and its stop are not in the file: the template names the law (double linear elastic).");
  return sentences;
}

void sum_nodal_masses(MbdynFile& file) {
  const Index n = file.mass.rows();
  file.Inv3 = file.Inv4 = MatrixXd::Zero(3, n);
  file.Inv8 = MatrixXd::Zero(3, 3 * n);
  file.Inv5 = MatrixXd::Zero(3, n * n);
  file.Inv9 = MatrixXd::Zero(3, 3 * n * n);
  for (size_t i = 0; i < file.masses.size(); ++i) {
    const double m = file.masses[i];
    const Eigen::Matrix3d u0 = tilde(file.positions.col(static_cast<Index>(i)));
    const Eigen::Matrix3Xd S = file.shapes[i].topRows<3>();
    file.Inv3 += m * S;
    file.Inv4 += m * u0 * S;
    for (Index j = 0; j < n; ++j) {
      const Eigen::Matrix3d S_j = tilde(S.col(j));
      file.Inv8.middleCols<3>(3 * j) -= m * u0 * S_j;
      file.Inv5.middleCols(n * j, n) += m * S_j * S;
      for (Index k = 0; k < n; ++k) file.Inv9.middleCols<3>(3 * (n * j + k)) += m * S_j * tilde(S.col(k));
    }
  }
}

ReadBack mbdyn_read_back(const ExportOptions&, const std::filesystem::path& path) {
  MbdynFile file = read_mbdyn(path);
  if (!file.masses.empty()) sum_nodal_masses(file);
  ReadBack back;
  back.m = file.m;
  back.mc0 = file.m * file.centre;
  back.J0 = file.inertia + centre_inertia(file.m, back.mc0);
  if (file.Inv3.cols() > 0) {
    back.Ct = file.Inv3;
    back.Cr0 = file.Inv4;
  }
  back.Me = file.mass;
  back.Ke = file.stiffness;
  for (size_t i = 0; i < file.labels.size(); ++i) {
    if (!file.masses.empty() && file.masses[i] > 0) continue;
    back.markers.push_back({file.labels[i], file.positions.col(static_cast<Index>(i)), file.shapes[i].topRows<3>(),
                            file.shapes[i].bottomRows<3>()});
  }
  return back;
}

}  // namespace flexboom
