#pragma once

#include "apps/model/model.hpp"
#include "apps/model/reduction.hpp"

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace flexboom {

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

/// Coordinates that `select` keeps, counted from 0. @throws UsageError, and InputError for one that the body lacks.
std::vector<int> selection(const ReducedBody&, const std::string& select);
/// What the choice may have missed, in a sentence; empty: nothing.
std::string note_of_selection(const ReducedBody&, const std::string& select);

/// "modal:0.005", "loss-factor:0.01", "rayleigh:ALPHA,BETA", "none". @throws InputError.
DampingRule parse_damping(const std::string&);

}  // namespace flexboom
