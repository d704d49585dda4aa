#include "reduction/exports/exports.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/exports/coupling.hpp"
#include "reduction/exports/exudyn.hpp"
#include "reduction/exports/integrals.hpp"
#include "reduction/exports/mbdyn.hpp"
#include "reduction/exports/nasa42.hpp"
#include "reduction/exports/reduced_matrix_market.hpp"
#include "reduction/exports/sid.hpp"
#include "reduction/exports/simscape.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <system_error>

namespace flexboom {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Ascending eigenvalues of Ke v = lambda Me v: (2 pi f)^2 whatever the coordinates are.
VectorXd eigenvalues(const MatrixXd& Me, const MatrixXd& Ke) {
  if (Me.size() == 0) return {};
  return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(Ke, Me, Eigen::EigenvaluesOnly).eigenvalues();
}

/// C A^-1 C^T.
MatrixXd through(const MatrixXd& A, const MatrixXd& C) {
  if (A.size() == 0) return MatrixXd::Zero(C.rows(), C.rows());
  return C * Eigen::LDLT<MatrixXd>(A).solve(MatrixXd(C.transpose()));
}

MatrixXd stacked(const Eigen::Matrix3Xd& top, const Eigen::Matrix3Xd& bottom) {
  MatrixXd C(6, top.cols());
  C << top, bottom;
  return C;
}

class ExportChecks {
 public:
  explicit ExportChecks(double tolerance) : tolerance_(tolerance) {}

  /// Largest deviation, relative to `scale`.
  void compare(const std::string& name, const MatrixXd& A, const MatrixXd& B, double scale) {
    if (A.rows() != B.rows() || A.cols() != B.cols()) {
      checks_.push_back({name, static_cast<double>(A.size()), static_cast<double>(B.size()), 1, false});
      return;
    }
    if (A.size() == 0) return;
    Eigen::Index row = 0;
    Eigen::Index col = 0;
    const double deviation = (A - B).cwiseAbs().maxCoeff(&row, &col);
    const double error = deviation == 0 ? 0 : deviation / scale;
    checks_.push_back({name, A(row, col), B(row, col), error, error <= tolerance_});
  }

  std::vector<BodyCheck> take() { return std::move(checks_); }

 private:
  double tolerance_;
  std::vector<BodyCheck> checks_;
};

const ExportSetting& find_setting(std::span<const ExportSetting> settings, std::string_view name) {
  const auto found = std::ranges::find(settings, name, &ExportSetting::name);
  std::string known;
  for (const ExportSetting& s : settings) known += fmt::format("{}\"{}\"", known.empty() ? "" : ", ", s.name);
  require(found != settings.end(), fmt::format("export setting \"{}\" is unknown; there are {}", name,
                                               known.empty() ? "none for this format" : known));
  return *found;
}

constexpr std::string_view number_kind = "number:";
constexpr std::string_view text_kind = "text:";

void check_value(const ExportSetting& s, const std::string& value) {
  if (s.values.starts_with(text_kind)) return;
  if (s.values.starts_with(number_kind)) {
    require(to_real(value).has_value(),
            fmt::format(R"(export setting "{}" must be a number, got "{}")", s.name, value));
    return;
  }
  const std::string among = fmt::format("|{}|", s.values);
  require(!value.empty() && value.find('|') == std::string::npos &&
              among.find(fmt::format("|{}|", value)) != std::string::npos,
          fmt::format(R"(export setting "{}" must be one of {}, got "{}")", s.name, s.values, value));
}

std::string default_value(const ExportSetting& s) {
  for (const std::string_view kind : {number_kind, text_kind}) {
    if (s.values.starts_with(kind)) return std::string(s.values.substr(kind.size()));
  }
  return std::string(s.values.substr(0, s.values.find('|')));
}

void make_folder(const std::filesystem::path& path) {
  if (path.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(path, error);
  require(!error, fmt::format("cannot make the folder {}: {}", path.string(), error.message()));
}

}  // namespace

std::span<const Exporter> exporters() {
  static const Exporter table[] = {
      {"coupling",
       ".json",
       "omega, zeta and participation factors L_P for attitude control toolboxes, JSON and CSV",
       {},
       write_coupling,
       coupling_cannot_hold,
       coupling_read_back},
      {"42", "/", "NASA 42: flex, node and passive joint files, body and joint blocks", settings_42(), write_42,
       cannot_hold_42, read_back_42},
      {"mbdyn", ".fem", "MBDyn modal element data, with a template of the modal joint", mbdyn_settings(), write_mbdyn,
       mbdyn_cannot_hold, mbdyn_read_back},
      {"sid", ".SID_FEM", "Standard input data (Wallrapp): Simpack, DLR FlexibleBodies, EMBSlib, welib", sid_settings(),
       write_sid, sid_cannot_hold, sid_read_back},
      {"exudyn",
       ".hdf5",
       "EXUDYN ObjectFFRFreducedOrderInterface",
       {},
       write_exudyn,
       exudyn_cannot_hold,
       exudyn_read_back},
      {"simscape",
       ".mat",
       "Simscape Multibody Reduced Order Flexible Solid: P, Q, K, M, C",
       {},
       write_simscape,
       simscape_cannot_hold,
       simscape_read_back},
      {"matrix-market",
       "/",
       "Me, Ke, De, shapes and inertia of the reduced body as .mtx files",
       {},
       write_reduced_matrices,
       reduced_matrices_cannot_hold,
       reduced_matrices_read_back},
  };
  return table;
}

const Exporter& exporter(std::string_view name) {
  std::string known;
  for (const Exporter& e : exporters()) {
    if (e.name == name) return e;
    known += fmt::format("{}\"{}\"", known.empty() ? "" : ", ", e.name);
  }
  throw InputError(fmt::format("no export format \"{}\"; there are {}", name, known));
}

std::string setting(std::span<const ExportSetting> settings, const ExportOptions& options, std::string_view name) {
  const ExportSetting& s = find_setting(settings, name);
  const auto given = options.settings.find(std::string(name));
  if (given == options.settings.end()) return default_value(s);
  check_value(s, given->second);
  return given->second;
}

double number_setting(std::span<const ExportSetting> settings, const ExportOptions& options, std::string_view name) {
  return *to_real(setting(settings, options, name));
}

std::string export_name(const std::filesystem::path& path) {
  std::string name = (path.has_filename() ? path : path.parent_path()).stem().string();
  require(!name.empty() && name != "." && name != "..",
          fmt::format("export to \"{}\": give a file or folder with a name", path.string()));
  return name;
}

ExportReport export_body(const ReducedBody& body, std::string_view format, const ExportOptions& options,
                         const std::filesystem::path& path) {
  const Exporter& e = exporter(format);
  for (const auto& [name, value] : options.settings) check_value(find_setting(e.settings, name), value);
  export_name(path);
  const bool folder = e.extension == "/";
  make_folder(folder ? path : path.parent_path());
  e.write(body, options, path);
  write_coordinate_table(body, (folder ? path : path.parent_path()) / (export_name(path) + ".coordinates.csv"));
  ExportReport report{e.cannot_hold(body), {}};
  if (e.read_back != nullptr) report.checks = check_read_back(body, e.read_back(options, path));
  return report;
}

std::vector<BodyCheck> check_read_back(const ReducedBody& body, const ReadBack& file, double tolerance) {
  ExportChecks list(tolerance);
  const double inertia = body.J0.cwiseAbs().maxCoeff();
  list.compare("m", MatrixXd::Constant(1, 1, file.m), MatrixXd::Constant(1, 1, body.m), body.m);
  list.compare("m c", file.mc0, body.mc0, std::sqrt(body.m * inertia));
  list.compare("J0", file.J0, body.J0, inertia);

  const VectorXd lambda = eigenvalues(body.Me, body.Ke);
  if (lambda.size() > 0) {
    // A free body has eigenvalues that are zero but for the round-off of the others.
    list.compare("(2 pi f)^2", eigenvalues(file.Me, file.Ke), lambda, lambda.cwiseAbs().maxCoeff());
  }
  if (file.Ct.cols() == file.Me.cols()) {  // a file without invariants has none
    const MatrixXd masses = through(body.Me, stacked(body.Ct, body.Cr0));
    list.compare("effective masses", through(file.Me, stacked(file.Ct, file.Cr0)), masses,
                 std::max({masses.cwiseAbs().maxCoeff(), body.m, inertia}));
  }

  const bool stiff = lambda.size() > 0 && lambda(0) > 1e-9 * lambda(lambda.size() - 1);
  // The softest shapes answer a force most, and have the round-off of the stiffest.
  const double round_off = stiff ? std::numeric_limits<double>::epsilon() * lambda(lambda.size() - 1) / lambda(0) : 0.0;
  for (size_t i = 0; stiff && i < std::min(file.markers.size(), body.markers.size()); ++i) {
    const Marker& there = file.markers[i];
    const Marker& here = body.markers[i];
    const MatrixXd compliance = through(body.Ke, stacked(here.S, here.S_theta));
    list.compare("unit forces at marker " + here.name, through(file.Ke, stacked(there.S, there.S_theta)), compliance,
                 compliance.cwiseAbs().maxCoeff() * std::max(1.0, round_off / tolerance));
  }
  return list.take();
}

void write_coordinate_table(const ReducedBody& body, const std::filesystem::path& path) {
  std::string text = "index,kind,frequency_hz,interface,direction,Ct_x,Ct_y,Ct_z,Cr0_x,Cr0_y,Cr0_z\n";
  for (Eigen::Index k = 0; k < body.n(); ++k) {
    const Coordinate& c = body.coordinates[static_cast<size_t>(k)];
    fmt::format_to(std::back_inserter(text), "{},{},{:.17g},{},{}", k, c.kind, c.frequency_hz,
                   c.interface.empty() ? "" : plain_name(c.interface), c.direction);
    for (const double value : body.Ct.col(k)) fmt::format_to(std::back_inserter(text), ",{:.17g}", value);
    for (const double value : body.Cr0.col(k)) fmt::format_to(std::back_inserter(text), ",{:.17g}", value);
    text += '\n';
  }
  write_file(path, text);
}

}  // namespace flexboom
