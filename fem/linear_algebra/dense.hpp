#pragma once

#include <Eigen/Core>

namespace flexboom {

enum class Transposed { no, yes };

/// Y += factor * A X, or A^T X, by the BLAS. Its kernels are those of the processor that it runs on. Eigen's are those
/// of the processor that the program was compiled for. For tall blocks; Y is neither A nor X.
void add_product(Eigen::Ref<Eigen::MatrixXd> Y, double factor, Transposed, const Eigen::Ref<const Eigen::MatrixXd>& A,
                 const Eigen::Ref<const Eigen::MatrixXd>& X);

/// Adds A A^T to the lower triangle of Y, by the BLAS.
void add_gram(Eigen::Ref<Eigen::MatrixXd> Y, const Eigen::Ref<const Eigen::MatrixXd>& A);

/// A^T X by the BLAS.
Eigen::MatrixXd transposed_product(const Eigen::Ref<const Eigen::MatrixXd>& A,
                                   const Eigen::Ref<const Eigen::MatrixXd>& X);

/// A X by the BLAS.
Eigen::MatrixXd product(const Eigen::Ref<const Eigen::MatrixXd>& A, const Eigen::Ref<const Eigen::MatrixXd>& X);

/// Eigenvalues and right eigenvectors of a real matrix, of length 1. Of a conjugate pair the eigenvalue with the
/// positive imaginary part comes first. The two columns are the real and the imaginary part of its vector.
struct RealEigenvectors {
  Eigen::VectorXd real, imaginary;
  Eigen::MatrixXd vectors;
};

/// By LAPACK. @throws InputError for a matrix that is not square, NumericalError when it does not converge.
RealEigenvectors eigenvectors(Eigen::MatrixXd A);

/// All x and nu of A x = nu B x, nu ascending, x^T B x = 1. A is symmetric, B positive definite.
struct SymmetricPairs {
  Eigen::VectorXd nu;
  Eigen::MatrixXd x;
};

/// By LAPACK (divide and conquer), from the lower triangles. @throws InputError for matrices that are not square or not
/// of one size, NumericalError where B is not positive definite or the algorithm does not converge.
SymmetricPairs symmetric_pairs(Eigen::MatrixXd A, Eigen::MatrixXd B);

/// By LAPACK. @throws InputError for a matrix that is not square, NumericalError when a pivot is zero.
Eigen::MatrixXd inverse(Eigen::MatrixXd A);

}  // namespace flexboom
