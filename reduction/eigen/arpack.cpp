#include "fem/base/check.hpp"
#include "reduction/eigen/backends.hpp"
#include "reduction/eigen/orthogonal_basis.hpp"

#include <arpack/arpack.hpp>

#include <array>
#include <string>
#include <vector>

namespace flexboom {
namespace {

constexpr double tolerance_of_many = 1e-10;  // machine precision takes twice the solves

/// The state of one dsaupd iteration: what ARPACK keeps between its returns to the caller.
struct Lanczos {
  Lanczos(int n_in, int nev_in, int most)
      : n(n_in),
        nev(nev_in),
        ncv(lanczos_vectors(nev_in, most)),
        residual(random_block(n_in, 1, 20201116)),
        V(n_in, ncv),
        work(3 * n_in),
        work_l(ncv * (ncv + 8)) {
    iparam[0] = 1;    // exact shifts
    iparam[2] = 500;  // restarts allowed
    iparam[3] = 1;    // block size, the only one there is
    iparam[6] = 3;    // mode: shift-invert
  }

  a_int n;
  a_int nev;
  a_int ncv;
  Eigen::VectorXd residual;
  Eigen::MatrixXd V;
  Eigen::VectorXd work;
  Eigen::VectorXd work_l;
  std::array<a_int, 11> iparam{};
  std::array<a_int, 11> ipntr{};
  a_int info = 1;  // in: a start vector is given; out: the return code
};

void check_code(a_int info, const char* routine) {
  if (info == 0) return;
  std::string text = std::string("ARPACK ") + routine + ": code " + std::to_string(info);
  if (info == 1) text += " (no convergence within the restarts allowed)";
  if (info == 3) text += " (no shifts could be applied: too few Lanczos vectors)";
  if (info == -9999) text += " (no Krylov space of that size: fewer finite eigenvalues than asked for?)";
  throw NumericalError(text);
}

/// Reverse communication: ARPACK asks for y = (K - sigma M)^-1 M x or y = M x until it is content. Returns the number
/// of solves.
int iterate(Lanczos& a, const EigenProblem& problem, const SparseFactor& shifted, double tolerance) {
  const auto slot = [&a](int i) { return a.work.segment(a.ipntr[static_cast<size_t>(i)] - 1, a.n); };
  Eigen::VectorXd b(a.n);
  int solves = 0;
  for (a_int ido = 0; ido != 99;) {
    arpack::saupd(ido, arpack::bmat::generalized, a.n, arpack::which::largest_algebraic, a.nev, tolerance,
                  a.residual.data(), a.ncv, a.V.data(), a.n, a.iparam.data(), a.ipntr.data(), a.work.data(),
                  a.work_l.data(), static_cast<a_int>(a.work_l.size()), a.info);
    if (ido == -1 || ido == 1) {
      if (ido == -1) {
        symmetric_product(problem.M, slot(0), b);
      } else {
        b = slot(2);  // M x is there already
      }
      shifted.solve(b, slot(1));
      ++solves;
    } else if (ido == 2) {
      symmetric_product(problem.M, slot(0), slot(1));
    } else if (ido != 99) {
      throw NumericalError("ARPACK dsaupd: unexpected request " + std::to_string(ido));
    }
  }
  check_code(a.info, "dsaupd");
  return solves;
}

}  // namespace

EigenPairs arpack_modes(const EigenProblem& problem, const SparseFactor& shifted, const EigenRequest& request) {
  const int count = request.count;
  const auto n = static_cast<int>(problem.K.rows());
  const double tolerance = request.tolerance > 0 || n < many_unknowns ? request.tolerance : tolerance_of_many;
  Lanczos a(n, count, finite_eigenvalues(problem));
  EigenPairs pairs;
  pairs.summary.solves = iterate(a, problem, shifted, tolerance);
  pairs.summary.iterations = a.iparam[2];
  if (a.iparam[4] < count) {
    throw NumericalError("ARPACK: " + std::to_string(a.iparam[4]) + " of " + std::to_string(count) +
                         " eigenvalues converged");
  }
  pairs.lambda.resize(count);
  pairs.Phi.resize(a.n, count);
  std::vector<a_int> select(static_cast<size_t>(a.ncv));
  arpack::seupd(1, arpack::howmny::ritz_vectors, select.data(), pairs.lambda.data(), pairs.Phi.data(), a.n,
                request.sigma, arpack::bmat::generalized, a.n, arpack::which::largest_algebraic, a.nev, tolerance,
                a.residual.data(), a.ncv, a.V.data(), a.n, a.iparam.data(), a.ipntr.data(), a.work.data(),
                a.work_l.data(), static_cast<a_int>(a.work_l.size()), a.info);
  check_code(a.info, "dseupd");
  return pairs;
}

}  // namespace flexboom
