#include "reduction/exports/reduced_matrix_market.hpp"

#include "fem/base/check.hpp"
#include "reduction/exports/matrix_market.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexboom {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::MatrixXd;

void write_reduced_matrices(const ReducedBody& body, const ExportOptions&, const fs::path& folder) {
  require(body.gram.size() > 0, "export of \"" + body.name + "\" to Matrix Market: the body has no gram");
  write_mtx(folder / "Me.mtx", body.Me, "int rho S^T S of " + body.name);
  write_mtx(folder / "Ke.mtx", body.Ke, "Stiffness of the coordinates of " + body.name);
  write_mtx(folder / "De.mtx", body.De, "Damping of the coordinates of " + body.name);
  write_mtx(folder / "gram.mtx", body.gram, "sum dm z z^T, z = (1, u0, S_1, ..., S_n), of " + body.name);
}

std::vector<std::string> reduced_matrices_cannot_hold(const ReducedBody& body) {
  std::vector<std::string> sentences;
  const GeometricStiffness& Kg = body.Kg;
  if (!Kg.spin.empty() || !Kg.acceleration.empty() || !Kg.angular_acceleration.empty() || !Kg.markers.empty()) {
    sentences.emplace_back("Geometric stiffness is left out.");
  }
  if (!body.markers.empty()) sentences.emplace_back("Markers, interfaces and display are left out.");
  return sentences;
}

ReducedBody read_reduced_matrices(const fs::path& folder) {
  const auto square = [&](const char* file, Index size) {
    MatrixXd A = read_mtx_array(folder / file);
    require(A.rows() == size && A.cols() == size,
            fmt::format("{}/{} is {} x {}, must be {} x {}", folder.string(), file, A.rows(), A.cols(), size, size));
    return A;
  };
  const MatrixXd Ke = read_mtx_array(folder / "Ke.mtx");
  const Index n = Ke.rows();
  ReducedBody body = blank_body(folder.filename().string(), static_cast<int>(n));
  body.structure = body.frame = "unknown";
  body.Ke = square("Ke.mtx", n);
  body.De = square("De.mtx", n);
  set_invariants(body, square("gram.mtx", 4 + 3 * n));
  body.Me = square("Me.mtx", n);
  for (Index k = 0; k < n; ++k) body.coordinates.push_back({"mode", body.frequency(k) / (2 * std::numbers::pi)});
  body.validate();
  return body;
}

ReadBack reduced_matrices_read_back(const ExportOptions&, const fs::path& folder) {
  const ReducedBody body = read_reduced_matrices(folder);
  return {body.m, body.mc0, body.J0, body.Ct, body.Cr0, body.Me, body.Ke, {}};
}

}  // namespace flexboom
