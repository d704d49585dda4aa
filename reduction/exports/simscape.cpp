#include "reduction/exports/simscape.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <matio.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <system_error>

namespace flexboom {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

using MatFile = std::unique_ptr<mat_t, int (*)(mat_t*)>;
using MatVariable = std::unique_ptr<matvar_t, void (*)(matvar_t*)>;

constexpr std::string_view how_to_make_one =
    "make a Craig-Bampton body of frame \"free\": every interface with all six components kept, fixed-interface modes "
    "after them";

void require_that(const ReducedBody& body, bool condition, const std::string& fault) {
  require(condition, fmt::format("export of \"{}\" to Simscape: {}; {}", body.name, fault, how_to_make_one));
}

/// The interface moves by its own six coordinates, one each, and by no other.
void require_own_coordinates(const ReducedBody& body, const Interface& interface) {
  require_that(body, std::ranges::all_of(interface.components, [](bool kept) { return kept; }),
               "interface \"" + interface.name + "\" does not keep all six components");
  const int first = interface.first_coordinate;
  require_that(body, first >= 0 && first + 6 <= body.n(),
               "interface \"" + interface.name + "\" has no coordinates of its own");
  const Marker& place = marker(body, interface.name);
  MatrixXd motion(6, body.n());
  motion << place.S, place.S_theta;
  motion.middleCols<6>(first) -= Eigen::Matrix<double, 6, 6>::Identity();
  constexpr double round_off = 1e-9;  // shapes have the size 1 where a coordinate is a motion
  require_that(body, motion.cwiseAbs().maxCoeff() <= round_off,
               "the coordinates of interface \"" + interface.name + "\" are not its motions");
}

/// Coordinates in the order of the block: interfaces, then the rest.
std::vector<int> block_order(const ReducedBody& body) {
  std::vector<int> order;
  for (const Interface& interface : body.interfaces) {
    for (int c = 0; c < 6; ++c) order.push_back(interface.first_coordinate + c);
  }
  for (int k = 0; k < body.n(); ++k) {
    if (std::ranges::find(order, k) == order.end()) order.push_back(k);
  }
  require_that(body, std::ssize(order) == body.n(), "interfaces share coordinates");
  return order;
}

void write_variable(mat_t* file, const char* name, matio_classes kind, matio_types type, std::array<size_t, 2> shape,
                    const void* data) {
  // The library copies the data.
  const MatVariable variable(Mat_VarCreate(name, kind, type, 2, shape.data(), const_cast<void*>(data), 0), Mat_VarFree);
  require(variable && Mat_VarWrite(file, variable.get(), MAT_COMPRESSION_NONE) == 0,
          std::string("matio cannot write ") + name);
}

void write_matrix(mat_t* file, const char* name, const MatrixXd& A) {
  write_variable(file, name, MAT_C_DOUBLE, MAT_T_DOUBLE, {static_cast<size_t>(A.rows()), static_cast<size_t>(A.cols())},
                 A.data());
}

void write_text(mat_t* file, const char* name, const std::string& text) {
  write_variable(file, name, MAT_C_CHAR, MAT_T_UTF8, {1, text.size()}, text.data());
}

/// Names as rows of equal length, as MATLAB's char(...) makes them.
void write_names(mat_t* file, const char* name, const std::vector<std::string>& names) {
  size_t width = 0;
  for (const std::string& text : names) width = std::max(width, text.size());
  std::string columns(names.size() * width, ' ');
  for (size_t i = 0; i < names.size(); ++i) {
    for (size_t j = 0; j < names[i].size(); ++j) columns[j * names.size() + i] = names[i][j];
  }
  write_variable(file, name, MAT_C_CHAR, MAT_T_UTF8, {names.size(), width}, columns.data());
}

void write_model(const fs::path& path, const SimscapeModel& model, const std::string& program) {
  const MatFile file(Mat_CreateVer(path.c_str(), "MATLAB 5.0 MAT-file, by flexboom", MAT_FT_MAT5), Mat_Close);
  require(file != nullptr, "the file cannot be made");
  write_matrix(file.get(), "P", model.P);
  write_matrix(file.get(), "Q", model.Q);
  write_matrix(file.get(), "K", model.K);
  write_matrix(file.get(), "M", model.M);
  write_matrix(file.get(), "C", model.C);
  write_names(file.get(), "interfaces", model.interfaces);
  write_text(file.get(), "units", "SI: m, kg, s, N, rad");
  write_text(file.get(), "program", program.empty() ? "flexboom" : program);
}

MatVariable read_variable(mat_t* file, const char* name) {
  MatVariable variable(Mat_VarRead(file, name), Mat_VarFree);
  require(variable && variable->data != nullptr && variable->rank == 2, std::string("no variable ") + name);
  return variable;
}

MatrixXd read_matrix(mat_t* file, const char* name, Index rows, Index cols) {
  const MatVariable variable = read_variable(file, name);
  require(variable->class_type == MAT_C_DOUBLE && variable->data_type == MAT_T_DOUBLE && variable->isComplex == 0,
          std::string(name) + " is not a real matrix");
  const auto n = static_cast<Index>(variable->dims[0]);
  const auto m = static_cast<Index>(variable->dims[1]);
  require((rows < 0 || n == rows) && m == (cols < 0 ? n : cols),
          fmt::format("{} is {} x {}, which does not fit the other variables", name, n, m));
  return Eigen::Map<const MatrixXd>(static_cast<const double*>(variable->data), n, m);
}

std::vector<std::string> read_names(mat_t* file, Index count) {
  const MatVariable variable = read_variable(file, "interfaces");
  require(
      variable->class_type == MAT_C_CHAR && variable->data_size == 1 && static_cast<Index>(variable->dims[0]) == count,
      "interfaces must be one name per row of P");
  const auto* columns = static_cast<const char*>(variable->data);
  std::vector<std::string> names(variable->dims[0]);
  for (size_t i = 0; i < names.size(); ++i) {
    for (size_t j = 0; j < variable->dims[1]; ++j) names[i] += columns[j * names.size() + i];
    names[i].erase(names[i].find_last_not_of(' ') + 1);
  }
  return names;
}

bool equal(const SimscapeModel& a, const SimscapeModel& b) {
  return a.interfaces == b.interfaces && a.P == b.P && a.Q == b.Q && a.K == b.K && a.M == b.M && a.C == b.C;
}

std::string describe(const SimscapeRank& rank) {
  return fmt::format("K has rank deficiency {} (frequencies taken as zero: up to {:.3g} Hz, first other: {:.6g} Hz)",
                     rank.deficiency, rank.largest_zero_hz, rank.first_elastic_hz);
}

}  // namespace

MatrixXd SimscapeModel::rigid_motions() const {
  MatrixXd R = MatrixXd::Zero(K.rows(), 6);
  for (Index f = 0; f < P.rows(); ++f) {
    R.block<6, 6>(6 * f, 0).setIdentity();
    const Eigen::Vector3d p = P.row(f);
    R.block<3, 3>(6 * f, 3) << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;  // e x p, columns e
  }
  return R;
}

SimscapeRank rank_of_stiffness(const SimscapeModel& model) {
  const Eigen::LLT<MatrixXd> M(model.M);
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(model.K, model.M);
  if (M.info() != Eigen::Success || solver.info() != Eigen::Success) {
    throw NumericalError("Simscape: M is not positive definite, so the rank of K is not known");
  }
  const VectorXd& lambda = solver.eigenvalues();
  const double largest = lambda.cwiseAbs().maxCoeff();
  constexpr double zero = 1e-12;  // of the largest; round-off leaves a few 1e-16 of it
  const auto hz = [](double value) { return std::sqrt(std::abs(value)) / (2 * std::numbers::pi); };
  SimscapeRank rank;
  rank.first_elastic_hz = std::numeric_limits<double>::infinity();
  for (const double value : lambda) {
    if (std::abs(value) <= zero * largest) {
      ++rank.deficiency;
      rank.largest_zero_hz = std::max(rank.largest_zero_hz, hz(value));
    } else {
      rank.first_elastic_hz = std::min(rank.first_elastic_hz, hz(value));
    }
  }
  const MatrixXd R = model.rigid_motions();
  const MatrixXd KR = model.K * R;
  const MatrixXd force = KR.transpose() * M.solve(KR);
  const MatrixXd inertia = R.transpose() * model.M * R;
  rank.rigid_residual = (force.diagonal().array().abs() / inertia.diagonal().array()).sqrt().maxCoeff() / largest;
  return rank;
}

SimscapeModel simscape_model(const ReducedBody& body) {
  require_that(body, body.frame == "free", "its frame is \"" + body.frame + "\"");
  require_that(body, !body.interfaces.empty(), "it has no interfaces");
  for (const Interface& interface : body.interfaces) require_own_coordinates(body, interface);
  const std::vector<int> order = block_order(body);
  SimscapeModel model;
  const auto F = std::ssize(body.interfaces);
  model.P.resize(F, 3);
  for (Index f = 0; f < F; ++f) {
    model.interfaces.push_back(body.interfaces[static_cast<size_t>(f)].name);
    model.P.row(f) = marker(body, model.interfaces.back()).position;
  }
  model.Q = Eigen::RowVector4d(1, 0, 0, 0).replicate(F, 1);
  model.K = body.Ke(order, order);
  model.M = body.Me(order, order);
  model.C = body.De(order, order);
  return model;
}

void write_simscape(const ReducedBody& body, const ExportOptions&, const fs::path& path) {
  body.validate();
  const SimscapeModel model = simscape_model(body);
  const SimscapeRank rank = rank_of_stiffness(model);
  constexpr double tolerance = 1e-8;  // of constraint modes from a solve with a stiffness of condition 1e8 and more
  require_that(body, rank.deficiency == 6, describe(rank) + ", a free body has 6");
  require_that(body, rank.rigid_residual <= tolerance,
               fmt::format("a rigid motion of its interfaces strains it ({:.1e})", rank.rigid_residual));
  fs::path part = path;
  part += ".part";
  std::error_code error;
  try {
    write_model(part, model, body.provenance.program);
    require(equal(read_simscape(part), model), "the file reads back differently (is the disk full?)");
    fs::rename(part, path, error);
    require(!error, error.message());
  } catch (const InputError& fault) {
    fs::remove(part, error);
    throw InputError(fmt::format("cannot write {}: {}", path.string(), fault.what()));
  }
}

std::vector<std::string> simscape_cannot_hold(const ReducedBody& body) {
  std::vector<std::string> sentences;
  const GeometricStiffness& Kg = body.Kg;
  if (!Kg.spin.empty() || !Kg.acceleration.empty() || !Kg.angular_acceleration.empty() || !Kg.markers.empty()) {
    sentences.emplace_back("Geometric stiffness: Reduced Order Flexible Solid has none.");
  }
  sentences.emplace_back(
      "Inertia that changes with the deformation (Cr1, J1, J2): the block is given K, M and P only.");
  const auto is_interface = [&](const Marker& m) {
    return std::ranges::count(body.interfaces, m.name, &Interface::name);
  };
  for (const Marker& m : body.markers) {
    if (!is_interface(m)) sentences.push_back("Marker \"" + m.name + "\": only interfaces have frames.");
  }
  if (body.display.points.cols() > 0) {
    sentences.emplace_back("Display: the block takes its geometry from an STL or STEP file.");
  }
  sentences.emplace_back("Hinge and stop: no part of the file; joint blocks have limits.");
  if (body.frame == "free" && !body.interfaces.empty()) {
    sentences.push_back("Nothing of the rigid motions: " + describe(rank_of_stiffness(simscape_model(body))) + ".");
  }
  return sentences;
}

SimscapeModel read_simscape(const fs::path& path) {
  const MatFile file(Mat_Open(path.c_str(), MAT_ACC_RDONLY), Mat_Close);
  require(file != nullptr, "cannot read " + path.string() + ": there is no such MAT file");
  try {
    SimscapeModel model;
    model.P = read_matrix(file.get(), "P", -1, 3);
    const Index F = model.P.rows();
    model.Q = read_matrix(file.get(), "Q", F, 4);
    model.K = read_matrix(file.get(), "K", -1, -1);
    const Index n = model.K.rows();
    require(n >= 6 * F, fmt::format("K is {} x {}, smaller than six freedoms for each of {} interfaces", n, n, F));
    model.M = read_matrix(file.get(), "M", n, n);
    model.C = read_matrix(file.get(), "C", n, n);
    model.interfaces = read_names(file.get(), F);
    return model;
  } catch (const InputError& fault) {
    throw InputError(path.string() + ": " + fault.what());
  }
}

ReadBack simscape_read_back(const ExportOptions&, const fs::path& path) {
  const SimscapeModel model = read_simscape(path);
  const MatrixXd R = model.rigid_motions();
  const MatrixXd coupling = R.transpose() * model.M;  // (Ct; Cr0)
  const Eigen::Matrix<double, 6, 6> rigid = coupling * R;
  ReadBack back;
  back.m = rigid(0, 0);
  back.mc0 << rigid(1, 5), rigid(2, 3), rigid(0, 4);  // upper right block: -tilde(mc0)
  back.J0 = rigid.bottomRightCorner<3, 3>();
  back.Ct = coupling.topRows(3);
  back.Cr0 = coupling.bottomRows(3);
  back.Me = model.M;
  back.Ke = model.K;
  const MatrixXd I = MatrixXd::Identity(model.K.rows(), model.K.cols());
  for (size_t f = 0; f < model.interfaces.size(); ++f) {
    const auto first = 6 * static_cast<Index>(f);
    back.markers.push_back(
        {model.interfaces[f], model.P.row(first / 6), I.middleRows<3>(first), I.middleRows<3>(first + 3)});
  }
  return back;
}

}  // namespace flexboom
