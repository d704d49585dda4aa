#pragma once

#include "apps/model/model.hpp"
#include "reduction/basis/basis.hpp"
#include "reduction/body/reduced_body.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// Wall time of the stages of a reduction [s].
struct ReductionSeconds {
  double mesh = 0, assemble = 0, modes = 0, invariants = 0, stiffening = 0, certificate = 0, richer = 0, total = 0;
};

/// How a model becomes a reduced body, by `flexboom reduce` and for a flight.
struct ReductionOptions {
  BasisOptions basis;
  bool clamp_beside = false;  // the model's clamp holds beside interfaces
  std::optional<std::string> select;
  DampingRule damping;
  bool stiffening = true;
  std::vector<std::string> loads_at;  // node sets; empty: every marker that moves
  bool certified = true;              // false: the certificate has the invariants alone
  std::string source;                 // of the model, for the provenance
};

/// What the command line says of a reduction.
struct ReduceArguments {
  std::string model;
  ModelOptions options;
  std::filesystem::path file;
  std::optional<std::string> basis;  // one of basis_names; what the file asks for, or "clamped"
  std::optional<int> count;
  std::optional<std::string> backend;
  std::vector<std::string> interfaces;  // "SET" or "SET:distributing"
  std::string reference;                // interface that carries the body's frame
  bool orthonormal = false;
  std::vector<std::string> attachments;  // "SET.Fy"
  std::vector<double> hinge_stiffness;   // [N m/rad]
  std::vector<double> hinge_axis;        // of three; empty: z
  std::vector<double> spin;              // of "prestressed", three [rad/s]
  std::vector<double> acceleration;      // the same [m/s^2]
  std::vector<std::string> turns;        // "x", "y", "z" or "X,Y,Z"
  std::optional<std::string> select;   // "list:1,3", "band:0,500", "mass:0.9", "completeness:0.9", "output:tip.uy,0.01"
  std::optional<std::string> damping;  // "modal:0.005", "loss-factor:0.01", "rayleigh:ALPHA,BETA", "none"
  bool stiffening = true;
  std::vector<std::string> loads_at;  // node sets; empty: every marker that moves
  std::string errors = "all";         // what the file keeps for error estimates, of kept_for_errors
};

/// "all": a body with more modes and one of finer elements; "modes": the former.
inline constexpr std::array kept_for_errors = {"all", "modes", "none"};

/// What the command line asks for. @throws InputError for options that do not fit each other or the model.
ReductionOptions reduction_options(const ReduceArguments&, const Model&);

/// The reduced body with its certificate and provenance. The mesh of `model` may get reference nodes of interfaces; its
/// notes grow by what the basis has to say. Adds the time of its stages to `seconds`.
/// @throws InputError for a place that the model lacks, NumericalError as the bases.
ReducedBody make_reduced_body(Model& model, const ReductionOptions&, int threads, ReductionSeconds& seconds);

/// Mass, centre, inertia, coordinate table and checks of a body, as text.
std::string description(const ReducedBody&, const std::vector<BodyCheck>& checks);

/// The same as a document; `notes` beside it.
nlohmann::ordered_json body_json(const ReducedBody&, const std::vector<BodyCheck>& checks,
                                 const std::vector<std::string>& notes);
nlohmann::ordered_json seconds_json(const ReductionSeconds&);
std::string checks_text(const std::vector<BodyCheck>&);
nlohmann::ordered_json checks_json(const std::vector<BodyCheck>&);

/// "modal:0.005", "loss-factor:0.01", "rayleigh:ALPHA,BETA", "none". @throws InputError.
DampingRule parse_damping(const std::string&);

}  // namespace flexboom
