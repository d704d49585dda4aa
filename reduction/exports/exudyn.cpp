#include "reduction/exports/exudyn.hpp"

#include "fem/base/check.hpp"
#include "reduction/body/tilde.hpp"
#include "reduction/exports/exudyn_dictionary.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr Index nodes_per_marker = 6;

/// Mesh nodes of EXUDYN with their shapes.
struct Nodes {
  Matrix3Xd points;
  MatrixXd shapes;  // 3N x n
};

/// Distance of the six nodes from their marker: a hundredth of the size of the body.
double marker_arm(const ReducedBody& body) { return 0.01 * std::sqrt(body.J0.trace() / body.m); }

/// Nodes at +-r e_c from each marker, c = x, y, z, moved as if fixed to it: S +- r tilde(S_theta) e_c.
Nodes nodes_of(const ReducedBody& body) {
  const Index shown = body.display.points.cols();
  const Index count = shown + nodes_per_marker * std::ssize(body.markers);
  Nodes nodes{Matrix3Xd(3, count), MatrixXd(3 * count, body.n())};
  nodes.points.leftCols(shown) = body.display.points;
  for (Index i = 0; i < shown; ++i) nodes.shapes.middleRows<3>(3 * i) = body.display.S[static_cast<size_t>(i)];
  Index node = shown;
  for (const Marker& marker : body.markers) {
    for (const double r : {marker_arm(body), -marker_arm(body)}) {
      for (int c = 0; c < 3; ++c, ++node) {
        const Vector3d arm = r * Vector3d::Unit(c);
        nodes.points.col(node) = marker.position + arm;
        nodes.shapes.middleRows<3>(3 * node) = marker.S - tilde(arm) * marker.S_theta;
      }
    }
  }
  return nodes;
}

/// Integrals with tilde(S_k) side by side, in EXUDYN's names. For W = sum dm a b^T, sum dm tilde(a)^T tilde(b) =
/// tr W I - W^T: its symmetric part is the inertia integral, its skew part -tilde(sum dm a x b) / 2.
void add_integrals(ExudynDictionary& file, const ReducedBody& body) {
  const Index n = body.n();
  MatrixXd PhitTPsiTilde(3, 3 * n), XRefTildePsiTilde(3, 3 * n), PsiTildePsi(3 * n, n), PsiTildePsiTilde(3 * n, 3 * n);
  for (Index k = 0; k < n; ++k) {
    const auto kk = static_cast<size_t>(k);
    PhitTPsiTilde.middleCols<3>(3 * k) = tilde(body.Ct.col(k));
    XRefTildePsiTilde.middleCols<3>(3 * k) = (body.J1[kk] - tilde(body.Cr0.col(k))) / 2;
    PsiTildePsi.middleRows<3>(3 * k) = -body.Cr1[kk];
    for (Index l = 0; l < n; ++l) {
      PsiTildePsiTilde.block<3, 3>(3 * k, 3 * l) = body.J2[kk][static_cast<size_t>(l)] - tilde(body.Cr1[kk].col(l)) / 2;
    }
  }
  file["mPhitTPsi"] = MatrixXd(body.Ct);
  file["mPhitTPsiTilde"] = std::move(PhitTPsiTilde);
  file["mXRefTildePsi"] = MatrixXd(-body.Cr0);
  file["mXRefTildePsiTilde"] = std::move(XRefTildePsiTilde);
  file["mPsiTildePsi"] = std::move(PsiTildePsi);
  file["mPsiTildePsiTilde"] = std::move(PsiTildePsiTilde);
}

void add_markers(ExudynDictionary& file, const ReducedBody& body) {
  const auto markers = std::ssize(body.markers);
  std::vector<std::string> names;
  IntegerMatrix nodes(markers, nodes_per_marker);
  for (Index i = 0; i < markers; ++i) {
    names.push_back(body.markers[static_cast<size_t>(i)].name);
    for (Index j = 0; j < nodes_per_marker; ++j) nodes(i, j) = body.display.points.cols() + nodes_per_marker * i + j;
  }
  file["markerNames"] = std::move(names);
  file["markerNodes"] = std::move(nodes);
}

ExudynDictionary dictionary_of(const ReducedBody& body) {
  const Nodes nodes = nodes_of(body);
  const Vector3d centre = body.mc0 / body.m;
  IntegerMatrix triangles(std::ssize(body.display.triangles), 3);
  for (Index i = 0; i < triangles.rows(); ++i) {
    for (Index j = 0; j < 3; ++j) {
      triangles(i, j) = body.display.triangles[static_cast<size_t>(i)][static_cast<size_t>(j)];
    }
  }
  const long n = body.n();
  constexpr long parameters = 4;  // of a rotation: Euler parameters
  IntegerVector info(6);
  info << n, nodes.points.cols(), 3, parameters, 3 + parameters, 3 + parameters + n;

  ExudynDictionary file;
  file["type"] = "ObjectFFRFreducedOrderInterface";
  file["fileVersion"] = 1L;
  file["infoList"] = info;
  file["rigidBodyNodeType"] = "NodeType.RotationEulerParameters";
  file["postProcessingModes"] = EmptyDictionary{};
  file["xRef"] = Eigen::VectorXd(nodes.points.reshaped());
  file["modeBasis"] = nodes.shapes;
  file["trigList"] = std::move(triangles);
  file["totalMass"] = body.m;
  file["Mtt"] = MatrixXd(body.m * Matrix3d::Identity());
  file["chiU"] = Eigen::VectorXd(centre);
  file["chiUtilde"] = MatrixXd(tilde(centre));
  file["inertiaLocal"] = MatrixXd(body.J0);
  file["massMatrixReduced"] = body.Me;
  file["stiffnessMatrixReduced"] = body.Ke;
  add_integrals(file, body);
  // Passed over by EXUDYN's loader.
  file["name"] = body.name;
  file["units"] = "SI: m, kg, s, N, rad";
  file["program"] = body.provenance.program;
  file["dampingMatrixReduced"] = body.De;
  if (!body.markers.empty()) add_markers(file, body);
  return file;
}

/// An entry of a file.
template <class T>
const T& entry(const ExudynDictionary& file, const std::string& name) {
  const auto found = file.find(name);
  require(found != file.end(), "no entry \"" + name + "\"");
  const T* value = std::get_if<T>(&found->second);
  require(value != nullptr, "entry \"" + name + "\" is of another kind");
  return *value;
}

MatrixXd matrix(const ExudynDictionary& file, const std::string& name, Index rows, Index cols) {
  const auto& A = entry<MatrixXd>(file, name);
  require(A.rows() == rows && A.cols() == cols, "entry \"" + name + "\" is " + std::to_string(A.rows()) + " x " +
                                                    std::to_string(A.cols()) + ", must be " + std::to_string(rows) +
                                                    " x " + std::to_string(cols));
  return A;
}

/// The reverse of add_integrals.
void read_integrals(ReducedBody& body, const ExudynDictionary& file) {
  const Index n = body.n();
  body.m = entry<double>(file, "totalMass");
  const auto& centre = entry<Eigen::VectorXd>(file, "chiU");
  require(centre.size() == 3, "entry \"chiU\" must have 3 numbers");
  body.mc0 = body.m * centre;
  body.J0 = matrix(file, "inertiaLocal", 3, 3);
  body.Ct = matrix(file, "mPhitTPsi", 3, n);
  body.Cr0 = -matrix(file, "mXRefTildePsi", 3, n);
  const MatrixXd first = matrix(file, "mXRefTildePsiTilde", 3, 3 * n);
  const MatrixXd coupling = matrix(file, "mPsiTildePsi", 3 * n, n);
  const MatrixXd second = matrix(file, "mPsiTildePsiTilde", 3 * n, 3 * n);
  for (Index k = 0; k < n; ++k) {
    const auto kk = static_cast<size_t>(k);
    const Matrix3d J1 = first.middleCols<3>(3 * k);
    body.J1[kk] = J1 + J1.transpose();
    body.Cr1[kk] = -coupling.middleRows<3>(3 * k);
    for (Index l = 0; l < n; ++l) {
      const Matrix3d J2 = second.block<3, 3>(3 * k, 3 * l);
      body.J2[kk][static_cast<size_t>(l)] = (J2 + J2.transpose()) / 2;
    }
  }
}

/// Translation and rotation of six nodes as `MarkerSuperElementRigid` takes them with equal weights:
/// S = sum S_i / 6, S_theta = (sum tilde(p_i)^T tilde(p_i))^-1 sum tilde(p_i) S_i.
Marker marker_of(const std::string& name, const Nodes& nodes, const Eigen::Matrix<long, 1, Eigen::Dynamic>& members) {
  for (const long i : members) require(i >= 0 && i < nodes.points.cols(), "\"markerNodes\" names a node that is none");
  Marker marker{name, Vector3d::Zero(), Matrix3Xd::Zero(3, nodes.shapes.cols()), {}};
  const double weight = 1.0 / static_cast<double>(members.size());
  for (const long i : members) {
    marker.position += weight * nodes.points.col(i);
    marker.S += weight * nodes.shapes.middleRows<3>(3 * i);
  }
  Matrix3d inertia = Matrix3d::Zero();
  Matrix3Xd moment = Matrix3Xd::Zero(3, nodes.shapes.cols());
  for (const long i : members) {
    const Matrix3d P = tilde(nodes.points.col(i) - marker.position);
    inertia += P.transpose() * P;
    moment += P * nodes.shapes.middleRows<3>(3 * i);
  }
  marker.S_theta = inertia.inverse() * moment;
  return marker;
}

/// None are an empty array of floats where EXUDYN wrote the file.
IntegerMatrix triangles_of(const ExudynDictionary& file) {
  const auto found = file.find("trigList");
  const auto* none = found == file.end() ? nullptr : std::get_if<Eigen::VectorXd>(&found->second);
  return none != nullptr && none->size() == 0 ? IntegerMatrix(0, 3) : entry<IntegerMatrix>(file, "trigList");
}

void read_nodes(ReducedBody& body, const ExudynDictionary& file) {
  const auto& x = entry<Eigen::VectorXd>(file, "xRef");
  require(x.size() % 3 == 0, "entry \"xRef\" must have three numbers per node");
  const Nodes nodes{x.reshaped(3, x.size() / 3), matrix(file, "modeBasis", x.size(), body.n())};
  Index shown = nodes.points.cols();
  if (file.contains("markerNames")) {
    const auto& names = entry<std::vector<std::string>>(file, "markerNames");
    const auto& members = entry<IntegerMatrix>(file, "markerNodes");
    require(members.rows() == std::ssize(names) && members.cols() == nodes_per_marker,
            R"("markerNodes" must have six nodes for each of "markerNames")");
    for (Index i = 0; i < members.rows(); ++i) {
      body.markers.push_back(marker_of(names[static_cast<size_t>(i)], nodes, members.row(i)));
    }
    shown = members.minCoeff();
  }
  body.display.points = nodes.points.leftCols(shown);
  for (Index i = 0; i < shown; ++i) body.display.S.emplace_back(nodes.shapes.middleRows<3>(3 * i));
  const IntegerMatrix triangles = triangles_of(file);
  require(triangles.rows() == 0 || (triangles.cols() == 3 && triangles.minCoeff() >= 0 && triangles.maxCoeff() < shown),
          "\"trigList\" names a node that is none");
  for (Index i = 0; i < triangles.rows(); ++i) {
    const Eigen::Vector3i nodes_of_it = triangles.row(i).transpose().cast<int>();
    body.display.triangles.push_back({nodes_of_it(0), nodes_of_it(1), nodes_of_it(2)});
  }
}

ReducedBody body_of(const ExudynDictionary& file) {
  require(entry<long>(file, "fileVersion") == 1,
          "file version " + std::to_string(entry<long>(file, "fileVersion")) + " is unknown; version 1 is read");
  const Index n = entry<MatrixXd>(file, "massMatrixReduced").cols();
  ReducedBody body =
      blank_body(file.contains("name") ? entry<std::string>(file, "name") : "exudyn", static_cast<int>(n));
  body.structure = "solid";
  body.frame = "unknown";
  body.Me = matrix(file, "massMatrixReduced", n, n);
  body.Ke = matrix(file, "stiffnessMatrixReduced", n, n);
  if (file.contains("dampingMatrixReduced")) body.De = matrix(file, "dampingMatrixReduced", n, n);
  read_integrals(body, file);
  read_nodes(body, file);
  for (Index k = 0; k < n; ++k) body.coordinates.push_back({"mode", body.frequency(k) / (2 * std::numbers::pi)});
  body.validate();
  return body;
}

}  // namespace

void write_exudyn(const ReducedBody& body, const ExportOptions&, const std::filesystem::path& path) {
  const auto where = [&] { return "export of \"" + body.name + "\" to EXUDYN: "; };
  require(path.extension() == ".hdf5", where() + "the file must be called *.hdf5, got " + path.filename().string());
  require(body.n() > 0, where() + "a rigid body needs no file; use ObjectRigidBody");
  require(body.frame != "free", where() +
                                    "the coordinates hold the rigid motions, which EXUDYN's reference frame has " +
                                    R"(already; use a body of frame "clamped" or "mean-axis")");
  require(body.display.points.cols() > 0 || !body.markers.empty(), where() + "the body has neither points nor markers");
  body.validate();
  write_exudyn_dictionary(path, dictionary_of(body));
}

std::vector<std::string> exudyn_cannot_hold(const ReducedBody& body) {
  std::vector<std::string> sentences;
  if (!body.De.isZero(0)) {
    sentences.emplace_back(
        "Damping: AddObjectFFRFreducedOrder takes Rayleigh factors only; De is in the file as dampingMatrixReduced, to "
        "be set on the object with mbs.SetObjectParameter.");
  }
  const GeometricStiffness& Kg = body.Kg;
  if (!Kg.spin.empty() || !Kg.acceleration.empty() || !Kg.angular_acceleration.empty() || !Kg.markers.empty()) {
    sentences.emplace_back(
        "Geometric stiffness: ObjectFFRFreducedOrder has none, so the body softens under spin instead of stiffening.");
  }
  if (!body.Ct.isZero(1e-9 * std::sqrt(body.m * body.Me.diagonal().maxCoeff()))) {
    sentences.emplace_back(
        "Gravity: LoadMassProportional acts in the mass centre of the undeformed body, so it turns a deflected one.");
  }
  if (!body.markers.empty()) {
    sentences.emplace_back(
        "Rotations: nodes carry translations only; each marker is six nodes for MarkerSuperElementRigid (markerNames, "
        "markerNodes).");
  }
  if (!body.display.lines.empty()) sentences.emplace_back("Lines of the display are shown as nodes.");
  sentences.emplace_back(
      "Hinge and stop: no part of the file; ObjectConnectorCoordinateSpringDamperExt has limit stops.");
  return sentences;
}

ReducedBody read_exudyn(const std::filesystem::path& path) {
  try {
    return body_of(read_exudyn_dictionary(path));
  } catch (const InputError& fault) {
    const std::string text = fault.what();
    throw InputError(text.find(path.string()) == std::string::npos ? path.string() + ": " + text : text);
  }
}

ReadBack exudyn_read_back(const ExportOptions&, const std::filesystem::path& path) {
  ReducedBody body = read_exudyn(path);
  return {body.m, body.mc0, body.J0, body.Ct, body.Cr0, body.Me, body.Ke, std::move(body.markers)};
}

}  // namespace flexboom
