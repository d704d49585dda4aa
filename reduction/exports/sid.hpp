#pragma once

#include "reduction/exports/exports.hpp"

#include <utility>

namespace flexboom {

/// m(q) = m0 + sum q_k m1[k].
struct Taylor {
  Eigen::MatrixXd m0;
  std::vector<Eigen::MatrixXd> m1;  // one per mode, or none: order 0
};

struct SidNode {
  int id = 0;
  Taylor origin;  // 3 x 1
  Taylor phi;     // 3 x n; its first order is geometric stiffening by forces here
  Taylor psi;     // 3 x n, the same of torques
  Taylor AP;      // 3 x 3, node axes -> BRF
};

/// Standard input data of a flexible body (Wallrapp 1994; Schwertassek & Wallrapp 1999, table 6.9), in one form
/// whatever the dialect of the file was. Equations of motion with a, omega in body axes:
///   Me q'' + Ct (a - g) + Cr omega' + Ge(q') omega + Oe (w1^2, w2^2, w3^2, w1 w2, w2 w3, w1 w3) + Ke q + De q' = ...
struct SidFile {
  double mass = 0;
  std::vector<std::pair<std::string, double>> modes;  // name and frequency [Hz]
  std::vector<SidNode> nodes;
  Taylor mdCM;    // 3 x 1
  Taylor J;       // 3 x 3
  Taylor Ct;      // n x 3; first order: stiffening by acceleration
  Taylor Cr;      // n x 3; first order: int S_l x S_k, and stiffening by angular acceleration
  Taylor Me;      // n x n
  Taylor Gr;      // 3 x 3n, three columns per mode: -2 int tilde(u0) tilde(S_k)
  Taylor Ge;      // n x 3n, three columns per mode: Ge(k, 3l + c) = 2 int (S_l x S_k)_c
  Taylor Oe;      // n x 6, columns xx yy zz xy yz xz; first order with stiffening by spin
  Taylor ksigma;  // n x 1
  Taylor Ke;      // n x n
  Taylor De;      // n x n
};

std::span<const ExportSetting> sid_settings();

/// Standard input data of a body. @throws InputError when the body has no gram.
SidFile sid_file(const ReducedBody&, const ExportOptions&);

/// Identities between the matrices, from the file alone. They are mdCM.m1 = Ct^T, Ge = 2 x the antisymmetric part of
/// Cr.m1, and Oe.m0 from J.m1. The symmetric part of Gr is J.m1, its antisymmetric part -tilde(Cr.m0). Effective masses
/// stay within the mass.
std::vector<BodyCheck> sid_identities(const SidFile&, double tolerance = 1e-10);

/// Reads a file in the dialect that the options name. @throws InputError with file:line:column.
SidFile read_sid(const std::filesystem::path&, const ExportOptions&);

/// @throws NumericalError when an identity does not hold; nothing is written then.
void write_sid(const ReducedBody&, const ExportOptions&, const std::filesystem::path&);
std::vector<std::string> sid_cannot_hold(const ReducedBody&);
ReadBack sid_read_back(const ExportOptions&, const std::filesystem::path&);

}  // namespace flexboom
