#include "reduction/exports/nasa42.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/exports/integrals.hpp"

#include <fmt/format.h>

#include <iterator>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;

constexpr ExportSetting settings_of_42[] = {
    {"joints", "text:", "joints that touch this body beside its inner one: INDEX=MARKER, ..."},
    {"spring", "number:0", "torsion spring of the inner joint [N m/rad]"},
    {"damper", "number:0", "its damper [N m s/rad]"},
    {"stop_stiffness", "number:0", "stiffness of a stop [N m/rad]: a comment only"},
    {"stop_angle", "number:0", "joint angle at which the stop begins [rad]: a comment only"},
};

constexpr size_t longest_name = 29;  // 42 keeps file names of 39 characters

Node42 node_of(const Marker& m) {
  std::string label = m.name;
  for (char& c : label) {
    if (c == '"' || c == '\n' || c == '\r') c = '_';
  }
  return {label.empty() ? "_" : label.substr(0, 39), -1, m.position, m.S, m.S_theta};
}

/// "1=tip, 2=middle".
std::vector<Node42> joints_of(const ReducedBody& body, std::string_view list) {
  std::vector<Node42> joints;
  while (!trimmed(list).empty()) {
    const size_t comma = std::min(list.find(','), list.size());
    const std::string_view item = trimmed(list.substr(0, comma));
    const size_t equals = item.find('=');
    const auto index = to_integer(trimmed(item.substr(0, equals)));
    require(equals != std::string_view::npos && index && *index >= 0,
            fmt::format("export setting \"joints\": INDEX=MARKER is needed, got {}", quoted(item)));
    joints.push_back(node_of(marker(body, std::string(trimmed(item.substr(equals + 1))))));
    joints.back().joint = static_cast<int>(*index);
    list = list.substr(std::min(comma + 1, list.size()));
  }
  return joints;
}

/// Lines of 42: values, then a comment; the reader keeps 79 characters of a comment or heading.
class Writer42 {
 public:
  void heading(std::string_view text) { line(fmt::format("{:*^64}", fmt::format("  {}  ", text))); }
  void line(std::string_view text) { (text_ += text) += '\n'; }

  template <class... Values>
  void values(std::string_view comment, const Values&... v) {
    (write(v), ...);
    line(fmt::format("  ! {}", comment));
  }

  const std::string& text() const { return text_; }

 private:
  void write(double v) { fmt::format_to(std::back_inserter(text_), " {:.17g}", v); }
  void write(Index v) { fmt::format_to(std::back_inserter(text_), " {}", v); }
  void write(const Eigen::Vector3d& v) {
    for (const double x : v) write(x);
  }

  std::string text_;
};

/// Entries that are not zero, by a list that is counted before it is written.
class NonZeros {
 public:
  template <class... Indices>
  void add(double value, Indices... index) {
    if (value == 0) return;
    for (const Index i : {static_cast<Index>(index)...}) fmt::format_to(std::back_inserter(lines_), " {}", i);
    fmt::format_to(std::back_inserter(lines_), " {:.17g}  ! {}\n", value, comment_);
    ++count_;
  }

  explicit NonZeros(std::string_view comment) : comment_(comment) {}

  void write(Writer42& w, std::string_view title) {
    w.heading(title);
    w.values("Number of non-zero elements", count_);
    if (!lines_.empty()) w.line(std::string_view(lines_).substr(0, lines_.size() - 1));
  }

 private:
  std::string comment_;
  std::string lines_;
  Index count_ = 0;
};

void write_shapes(Writer42& w, const std::vector<Node42>& nodes, bool joints) {
  const std::string comment = joints ? "[Mode] [Joint] [Axis] Value" : "[Mode] [Node] [Axis] Value";
  for (const bool rotation : {false, true}) {
    NonZeros entries(comment);
    for (size_t i = 0; i < nodes.size(); ++i) {
      const Matrix3Xd& shape = rotation ? nodes[i].THETA : nodes[i].PSI;
      const Index number = joints ? nodes[i].joint : static_cast<Index>(i);
      for (Index k = 0; k < shape.cols(); ++k) {
        for (Index axis = 0; axis < 3; ++axis) entries.add(shape(axis, k), k, number, axis);
      }
    }
    entries.write(w, rotation ? "Non-zero Rotation Mode Shape (THETA) Elements"
                              : "Non-zero Translation Mode Shape (PSI) Elements");
  }
}

void write_matrix(Writer42& w, const MatrixXd& A, std::string_view title) {
  NonZeros entries("[Row] [Col] Value");
  for (Index i = 0; i < A.rows(); ++i) {
    for (Index j = 0; j < A.cols(); ++j) entries.add(A(i, j), i, j);
  }
  entries.write(w, title);
}

std::string flex_text(const File42& file, const ReducedBody& body) {
  const Index n = file.Mf.rows();
  Writer42 w;
  w.line("<<<<<<<<<<<<<<  Flexible Body Inputs for 42  >>>>>>>>>>>>>>>>>>>");
  w.line(fmt::format("{}, SI units, {} frame  ! Description", plain_name(body.name).substr(0, 30), body.frame));
  w.values("Number of Flex Modes", n);
  w.heading("Initial Modal States x, u");
  for (Index k = 0; k < n; ++k) {
    const Coordinate& c = body.coordinates[static_cast<size_t>(k)];
    w.values(fmt::format("Mode {} x, u: {} {:.6g} Hz", k, c.kind.substr(0, 30), c.frequency_hz), 0.0, 0.0);
  }
  w.heading("Joint Node Mode Shapes");
  write_shapes(w, file.joints, true);
  w.heading("Analysis Node Mode Shapes");
  write_shapes(w, file.nodes, false);
  write_matrix(w, file.Mf, "Non-zero Mass Matrix Elements");
  write_matrix(w, file.Kf, "Non-zero Stiffness Matrix Elements");
  write_matrix(w, file.Cf, "Non-zero Damping Matrix Elements");
  w.heading("Linear Momentum Modal Integral, Pf, 3 x Nf");
  for (Index k = 0; k < n; ++k) w.values(fmt::format("Mode {}, [x y z]", k), Eigen::Vector3d(file.Pf.col(k)));
  w.heading("Angular Momentum Modal Integral, Hf, 3 x Nf");
  for (Index k = 0; k < n; ++k) w.values(fmt::format("Mode {}, [x y z]", k), Eigen::Vector3d(file.Hf.col(k)));
  NonZeros L("[i] [j] [Mode] Value");
  NonZeros N("[i] [j] [Mode] [Mode] Value");
  for (Index k = 0; k < n; ++k) {
    for (Index i = 0; i < 3; ++i) {
      for (Index j = 0; j < 3; ++j) {
        L.add(file.L[static_cast<size_t>(k)](i, j), i, j, k);
        for (Index l = 0; l < n; ++l) N.add(file.N[static_cast<size_t>(k)][static_cast<size_t>(l)](i, j), i, j, k, l);
      }
    }
  }
  L.write(w, "Linear Modal Integral, L, 3 x 3 x Nf");
  N.write(w, "Angular Modal Integral, N, 3 x 3 x Nf x Nf");
  w.line("[EOF]");
  return w.text();
}

std::string nodes_text(const File42& file, const std::string& name) {
  Writer42 w;
  w.line("<<<<<<<<<<<<<<<<  Body Node Inputs for 42  >>>>>>>>>>>>>>>>>>>>>");
  w.line(fmt::format("{}  ! Description", name));
  w.values("Number of Nodes", std::ssize(file.nodes));
  w.heading("Node Location, Comment");
  for (const Node42& node : file.nodes) {
    w.line(fmt::format("{:.17g} {:.17g} {:.17g} \"{}\"", node.position.x(), node.position.y(), node.position.z(),
                       node.label));
  }
  return w.text();
}

std::string joint_text(const PassiveJoint42& joint, const std::string& name, double stop_stiffness, double stop_angle) {
  Writer42 w;
  w.line("<<<<<<<<<<<<<<  Passive Joint Parameters for 42  >>>>>>>>>>>>>>>");
  w.line(fmt::format("Inner joint of {}  ! Description", name));
  w.heading("Linear springs and dampers, zero at joint angle zero");
  w.values("Rotational Spring Coefficients, Nm/rad", joint.rotation_spring);
  w.values("Rotational Damping Coefficients, Nm/(rad/s)", joint.rotation_damper);
  w.values("Translational Spring Coefficients, N/m", joint.translation_spring);
  w.values("Translational Damping Coefficients, N/(m/s)", joint.translation_damper);
  if (stop_stiffness > 0) {
    w.line("! 42 has linear springs only: this stop is NOT in the numbers above.");
    w.line("! Its bilinear law, to be added in PassiveJoint() of 42joints.c:");
    w.line("!   if (G->Ang[0] > stop) G->Trq[0] -= k_stop*(G->Ang[0] - stop);");
    w.line(fmt::format("!   stop = {:.17g} rad, k_stop = {:.17g} Nm/rad", stop_angle, stop_stiffness));
  }
  return w.text();
}

std::string block_text(const File42& file, const std::string& name) {
  Writer42 w;
  w.heading("Lines for the spacecraft file of 42");
  w.line("GAUSS_ELIM  ! Solve Dynamics by GAUSS_ELIM (ORDER_N refuses flex)");
  w.line(fmt::format("{}  ! Mass Props referenced to REFPT_CM or REFPT_JOINT",
                     file.about_centre ? "REFPT_CM" : "REFPT_JOINT"));
  w.line("TRUE  ! Flex Active");
  w.line("TRUE  ! Include 2nd Order Flex Terms");
  w.heading("Body");
  w.values("Mass", file.mass);
  w.values("Moments of Inertia (kg-m^2)", Eigen::Vector3d(file.inertia.diagonal()));
  // 42 turns the signs of these.
  w.values("Products of Inertia (xy,xz,yz)", -file.inertia(0, 1), -file.inertia(0, 2), -file.inertia(1, 2));
  w.values("Location of mass center, m", file.centre);
  w.line("0.0 0.0 0.0  ! Constant Embedded Momentum (Nms)");
  w.line("0.0 0.0 0.0  ! Constant Embedded Magnetic Dipole (A-m^2)");
  w.line("NONE  ! Geometry Input File Name: to be completed");
  w.line(file.nodes.empty() ? "NONE  ! Node File Name" : fmt::format("Nodes_{}.txt  ! Node File Name", name));
  w.line(fmt::format("Flex_{}.txt  ! Flex File Name", name));
  w.heading("Joint to the inner body: to be completed");
  w.line("PASSIVE  ! Type of joint");
  w.line("! frames: angle zero where the spring is at rest, rotation axis 1 is");
  w.line("! the hinge; outer body origin is the joint: 0.0 0.0 0.0");
  w.line(fmt::format("Joint_{}.txt  ! Parameter File Name", name));
  return w.text();
}

std::string name_in_files(const std::filesystem::path& folder) {
  std::string name = plain_name(export_name(folder));
  require(name.size() <= longest_name,
          fmt::format("export to \"{}\": 42 takes file names of 39 characters, so this name "
                      "must have {} or less",
                      name, longest_name));
  return name;
}

}  // namespace

std::span<const ExportSetting> settings_42() { return settings_of_42; }

File42 file_42(const ReducedBody& body, const ExportOptions& options) {
  require(body.frame == "clamped" || body.frame == "mean-axis",
          fmt::format(R"(body "{}": 42 takes clamped and mean-axis bodies, the frame of this one is "{}")", body.name,
                      body.frame));
  const Index n = body.n();
  const RawIntegrals raw(body, "42");
  File42 file;
  file.mass = body.m;
  file.centre = body.mc0 / body.m;
  file.about_centre = body.frame == "mean-axis";
  file.inertia = body.J0;
  if (file.about_centre) file.inertia -= centre_inertia(body.m, body.mc0);
  file.joints = joints_of(body, setting(settings_of_42, options, "joints"));
  for (const Marker& m : body.markers) file.nodes.push_back(node_of(m));
  file.Mf = body.Me;
  file.Kf = body.Ke;
  file.Cf = body.De;
  file.Pf = body.Ct;
  file.Hf = body.Cr0;
  for (Index k = 0; k < n; ++k) {
    file.L.emplace_back(raw.S_u0(k));
    file.N.emplace_back();
    for (Index l = 0; l < n; ++l) file.N.back().emplace_back(raw.S_S(k, l));
  }
  file.joint.rotation_spring.x() = number_setting(settings_of_42, options, "spring");
  file.joint.rotation_damper.x() = number_setting(settings_of_42, options, "damper");
  return file;
}

void write_42(const ReducedBody& body, const ExportOptions& options, const std::filesystem::path& folder) {
  const File42 file = file_42(body, options);
  const std::string name = name_in_files(folder);
  write_file(folder / fmt::format("Flex_{}.txt", name), flex_text(file, body));
  write_file(folder / fmt::format("Nodes_{}.txt", name), nodes_text(file, name));
  write_file(folder / fmt::format("Joint_{}.txt", name),
             joint_text(file.joint, name, number_setting(settings_of_42, options, "stop_stiffness"),
                        number_setting(settings_of_42, options, "stop_angle")));
  write_file(folder / fmt::format("Block_{}.txt", name), block_text(file, name));
}

std::vector<std::string> cannot_hold_42(const ReducedBody& body) {
  std::vector<std::string> sentences = {
      "A passive joint of 42 has a linear spring and damper: a stop is written as a comment with the line of code to "
      "add."};
  if (body.n() == 0) return sentences;
  sentences.emplace_back(
      "42 keeps the inertia of the undeformed body and has no Coriolis torque of the modes on the body: J1, J2 and "
      "their rates are left out of its equations.");
  if (!body.Kg.spin.empty() || !body.Kg.acceleration.empty() || !body.Kg.markers.empty()) {
    sentences.emplace_back("Geometric stiffening has no place in 42: spinning bodies soften instead.");
  }
  double fastest = 0;
  for (const Coordinate& c : body.coordinates) fastest = std::max(fastest, c.frequency_hz);
  if (fastest > 0) {
    sentences.push_back(
        fmt::format("42 stops when its step is above half a period of any mode: here {:.3g} s.", 1 / (2 * fastest)));
  }
  if (body.frame == "mean-axis") {
    sentences.emplace_back("With REFPT_CM 42 takes linear and angular momentum of the modes for zero.");
  }
  return sentences;
}

ReadBack read_back_42(const ExportOptions&, const std::filesystem::path& folder) {
  const File42 file = read_42(folder);
  ReadBack back{.m = file.mass,
                .mc0 = file.mass * file.centre,
                .J0 = file.inertia,
                .Ct = file.Pf,
                .Cr0 = file.Hf,
                .Me = file.Mf,
                .Ke = file.Kf,
                .markers = {}};
  if (file.about_centre) back.J0 += centre_inertia(file.mass, back.mc0);
  for (const Node42& node : file.nodes) back.markers.push_back({node.label, node.position, node.PSI, node.THETA});
  return back;
}

}  // namespace flexboom
