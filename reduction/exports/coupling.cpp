#include "reduction/exports/coupling.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/body/rigid_motion.hpp"
#include "reduction/exports/integrals.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <iterator>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Json = nlohmann::ordered_json;

constexpr std::string_view coupling_format = "flexboom-coupling-1";

/// Rows of a matrix; a column becomes a flat array.
Json rows(const MatrixXd& A) {
  Json result = Json::array();
  for (Index i = 0; i < A.rows(); ++i) {
    Json row = Json::array();
    for (Index j = 0; j < A.cols(); ++j) row.push_back(A(i, j));
    result.push_back(row);
  }
  return result;
}

Json list(const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); }

MatrixXd matrix(const Json& json, Index n_rows, Index n_cols) {
  require(std::ssize(json) == n_rows, fmt::format("{} rows, must be {}", json.size(), n_rows));
  MatrixXd A(n_rows, n_cols);
  for (Index i = 0; i < n_rows; ++i) {
    const Json& row = json.at(static_cast<size_t>(i));
    require(std::ssize(row) == n_cols, fmt::format("a row of {} values, must be {}", row.size(), n_cols));
    for (Index j = 0; j < n_cols; ++j) A(i, j) = row.at(static_cast<size_t>(j)).get<double>();
  }
  return A;
}

Eigen::VectorXd vector(const Json& json, Index n) {
  require(std::ssize(json) == n, fmt::format("{} values, must be {}", json.size(), n));
  Eigen::VectorXd v(n);
  for (Index i = 0; i < n; ++i) v(i) = json.at(static_cast<size_t>(i)).get<double>();
  return v;
}

Json json_of(const CouplingFile& file) {
  Json json;
  json["format"] = coupling_format;
  json["body"] = file.name;
  json["frame"] = file.frame;
  json["units"] = "SI; kg, m, s, rad; coordinates of unit modal mass";
  json["axes"] = "body reference frame; rows of L_P: force x y z, torque x y z about its origin";
  json["mass"] = file.mass;
  json["centre"] = list(file.centre);
  json["inertia_about_origin"] = rows(file.inertia);
  json["kinds"] = file.kinds;
  json["omega"] = list(file.omega);
  json["zeta"] = list(file.zeta);
  json["damping"] = rows(file.damping);
  json["L_P"] = rows(file.L_P);
  json["residual_mass"] = rows(file.residual);
  json["nodes"] = Json::array();
  for (const Marker& m : file.markers) {
    Json node;
    node["name"] = m.name;
    node["position"] = list(m.position);
    node["S"] = rows(m.S);
    node["S_theta"] = rows(m.S_theta);
    json["nodes"].push_back(node);
  }
  return json;
}

CouplingFile file_of(const Json& json) {
  require(json.value("format", "") == coupling_format, fmt::format(R"("format" must be "{}")", coupling_format));
  CouplingFile file;
  file.name = json.at("body").get<std::string>();
  file.frame = json.at("frame").get<std::string>();
  file.mass = json.at("mass").get<double>();
  file.centre = vector(json.at("centre"), 3);
  file.inertia = matrix(json.at("inertia_about_origin"), 3, 3);
  file.kinds = json.at("kinds").get<std::vector<std::string>>();
  const Index n = std::ssize(file.kinds);
  file.omega = vector(json.at("omega"), n);
  file.zeta = vector(json.at("zeta"), n);
  file.damping = matrix(json.at("damping"), n, n);
  file.L_P = matrix(json.at("L_P"), 6, n);
  file.residual = matrix(json.at("residual_mass"), 6, 6);
  for (const Json& node : json.at("nodes")) {
    file.markers.push_back({node.at("name").get<std::string>(), vector(node.at("position"), 3),
                            matrix(node.at("S"), 3, n), matrix(node.at("S_theta"), 3, n)});
  }
  return file;
}

std::string modes_csv(const CouplingFile& file) {
  std::string text = "mode,kind,omega,zeta,L_Fx,L_Fy,L_Fz,L_Mx,L_My,L_Mz\n";
  for (Index k = 0; k < file.omega.size(); ++k) {
    fmt::format_to(std::back_inserter(text), "{},{},{:.17g},{:.17g}", k, file.kinds[static_cast<size_t>(k)],
                   file.omega(k), file.zeta(k));
    for (const double value : file.L_P.col(k)) fmt::format_to(std::back_inserter(text), ",{:.17g}", value);
    text += '\n';
  }
  return text;
}

std::string rigid_csv(const CouplingFile& file) {
  const Eigen::Matrix3d& J = file.inertia;
  return fmt::format(
      "name,value\nmass,{:.17g}\ncentre_x,{:.17g}\ncentre_y,{:.17g}\ncentre_z,{:.17g}\n"
      "J_xx,{:.17g}\nJ_yy,{:.17g}\nJ_zz,{:.17g}\nJ_xy,{:.17g}\nJ_xz,{:.17g}\nJ_yz,{:.17g}\n",
      file.mass, file.centre.x(), file.centre.y(), file.centre.z(), J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2),
      J(1, 2));
}

}  // namespace

CouplingFile coupling_file(const ReducedBody& body) {
  const ModalCoordinates modal = modal_coordinates(body);
  const Index n = body.n();
  CouplingFile file;
  file.name = body.name;
  file.frame = body.frame;
  file.mass = body.m;
  file.centre = body.mc0 / body.m;
  file.inertia = body.J0;
  for (const Coordinate& c : modal.coordinates) file.kinds.push_back(plain_name(c.kind));
  file.omega = modal.lambda.cwiseMax(0.0).cwiseSqrt();
  file.damping = modal.T.transpose() * body.De * modal.T;
  file.zeta = Eigen::VectorXd::Zero(n);
  const double fastest = n > 0 ? file.omega.maxCoeff() : 0;
  for (Index k = 0; k < n; ++k) {
    const bool rigid = file.omega(k) <= 1e-7 * fastest;  // omega^2 is round-off of the fastest
    if (rigid) file.omega(k) = 0;
    if (!rigid) file.zeta(k) = file.damping(k, k) / (2 * file.omega(k));
  }
  file.L_P.resize(6, n);
  file.L_P << body.Ct * modal.T, body.Cr0 * modal.T;
  file.residual = rigid_mass(body) - file.L_P * file.L_P.transpose();
  for (const Marker& m : body.markers) file.markers.push_back({m.name, m.position, m.S * modal.T, m.S_theta * modal.T});
  return file;
}

CouplingFile read_coupling(const std::filesystem::path& path) {
  const std::string bytes = file_bytes(path);
  try {
    return file_of(Json::parse(bytes));
  } catch (const nlohmann::json::exception& e) {
    throw InputError(fmt::format("{}: {}", path.string(), e.what()));
  } catch (const InputError& e) {
    throw InputError(fmt::format("{}: {}", path.string(), e.what()));
  }
}

void write_coupling(const ReducedBody& body, const ExportOptions&, const std::filesystem::path& path) {
  const CouplingFile file = coupling_file(body);
  const std::string name = export_name(path);
  write_file(path, json_of(file).dump(1) + "\n");
  write_file(path.parent_path() / (name + ".modes.csv"), modes_csv(file));
  write_file(path.parent_path() / (name + ".rigid.csv"), rigid_csv(file));
}

std::vector<std::string> coupling_cannot_hold(const ReducedBody& body) {
  std::vector<std::string> sentences;
  if (body.n() > 0) {
    sentences.emplace_back(
        "The model is linear about the undeformed body at rest: no terms of the second order, no gyroscopic and "
        "centrifugal terms of the modes, no geometric stiffening.");
    const MatrixXd D = coupling_file(body).damping;
    if (!D.isDiagonal(1e-9)) {
      sentences.emplace_back("Damping couples the modes: zeta has its diagonal, the entry \"damping\" all of it.");
    }
  }
  if (body.frame == "free")
    sentences.emplace_back("The modes hold rigid motions, which the rigid body has as well: clamp the body.");
  sentences.emplace_back("A hinge, its spring and its stop are not held.");
  return sentences;
}

ReadBack coupling_read_back(const ExportOptions&, const std::filesystem::path& path) {
  const CouplingFile file = read_coupling(path);
  const Index n = file.omega.size();
  return {.m = file.mass,
          .mc0 = file.mass * file.centre,
          .J0 = file.inertia,
          .Ct = file.L_P.topRows(3),
          .Cr0 = file.L_P.bottomRows(3),
          .Me = MatrixXd::Identity(n, n),
          .Ke = MatrixXd(file.omega.cwiseAbs2().asDiagonal()),
          .markers = file.markers};
}

}  // namespace flexboom
