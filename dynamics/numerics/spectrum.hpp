#pragma once

#include <Eigen/Core>

namespace flexboom {

/// Eigenvalues and eigenvectors of a real matrix: x = from_modes z, z = to_modes x. Of a complex pair the one with the
/// positive imaginary part is kept; z holds real parts, then imaginary parts. m eigenvalues: from_modes is nx x 2 m,
/// to_modes 2 m x nx. Pairs come first: the imaginary parts of real eigenvalues, at the end, are zero.
struct Spectrum {
  Eigen::VectorXcd lambda;
  Eigen::MatrixXd from_modes, to_modes;
};

/// @throws NumericalError when L has no full set of eigenvectors.
Spectrum spectrum_of(Eigen::MatrixXd L);

/// Of L + d e^T, e the unit vector of `column`, from the spectrum of L. What the difference hardly couples stays as it
/// is, so most eigenvectors of many modes are those of L.
/// @throws NumericalError when the block that is coupled has no full set of eigenvectors, or they are not found.
Spectrum with_column(const Spectrum&, const Eigen::VectorXd& d, int column);

}  // namespace flexboom
