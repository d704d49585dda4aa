#include "apps/sweep/sampling.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace flexboom {

namespace {

/// Finaliser of SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): every bit of the result depends on every bit of x.
constexpr std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31);
}

constexpr std::uint64_t hashed(std::uint64_t seed, std::uint64_t dimension, std::uint64_t run) {
  return mixed(mixed(mixed(seed) + dimension) + run);
}

/// A primitive polynomial of a degree, its inner coefficients as bits, and the first direction numbers.
struct DirectionNumbers {
  int degree;
  std::uint32_t coefficients;
  std::array<std::uint32_t, 9> first;
};

/// Dimensions 2 to 64 of new-joe-kuo-6.21201: S. Joe, F. Y. Kuo, "Constructing Sobol sequences with better
/// two-dimensional projections", SIAM J. Sci. Comput. 30, 2635-2654 (2008). Copyright (c) 2008, Frances Y. Kuo and
/// Stephen Joe; BSD licence.
constexpr std::array<DirectionNumbers, SobolSequence::most_dimensions - 1> joe_kuo = {
    {{1, 0, {1}},
     {2, 1, {1, 3}},
     {3, 1, {1, 3, 1}},
     {3, 2, {1, 1, 1}},
     {4, 1, {1, 1, 3, 3}},
     {4, 4, {1, 3, 5, 13}},
     {5, 2, {1, 1, 5, 5, 17}},
     {5, 4, {1, 1, 5, 5, 5}},
     {5, 7, {1, 1, 7, 11, 19}},
     {5, 11, {1, 1, 5, 1, 1}},
     {5, 13, {1, 1, 1, 3, 11}},
     {5, 14, {1, 3, 5, 5, 31}},
     {6, 1, {1, 3, 3, 9, 7, 49}},
     {6, 13, {1, 1, 1, 15, 21, 21}},
     {6, 16, {1, 3, 1, 13, 27, 49}},
     {6, 19, {1, 1, 1, 15, 7, 5}},
     {6, 22, {1, 3, 1, 15, 13, 25}},
     {6, 25, {1, 1, 5, 5, 19, 61}},
     {7, 1, {1, 3, 7, 11, 23, 15, 103}},
     {7, 4, {1, 3, 7, 13, 13, 15, 69}},
     {7, 7, {1, 1, 3, 13, 7, 35, 63}},
     {7, 8, {1, 3, 5, 9, 1, 25, 53}},
     {7, 14, {1, 3, 1, 13, 9, 35, 107}},
     {7, 19, {1, 3, 1, 5, 27, 61, 31}},
     {7, 21, {1, 1, 5, 11, 19, 41, 61}},
     {7, 28, {1, 3, 5, 3, 3, 13, 69}},
     {7, 31, {1, 1, 7, 13, 1, 19, 1}},
     {7, 32, {1, 3, 7, 5, 13, 19, 59}},
     {7, 37, {1, 1, 3, 9, 25, 29, 41}},
     {7, 41, {1, 3, 5, 13, 23, 1, 55}},
     {7, 42, {1, 3, 7, 3, 13, 59, 17}},
     {7, 50, {1, 3, 1, 3, 5, 53, 69}},
     {7, 55, {1, 1, 5, 5, 23, 33, 13}},
     {7, 56, {1, 1, 7, 7, 1, 61, 123}},
     {7, 59, {1, 1, 7, 9, 13, 61, 49}},
     {7, 62, {1, 3, 3, 5, 3, 55, 33}},
     {8, 14, {1, 3, 1, 15, 31, 13, 49, 245}},
     {8, 21, {1, 3, 5, 15, 31, 59, 63, 97}},
     {8, 22, {1, 3, 1, 11, 11, 11, 77, 249}},
     {8, 38, {1, 3, 1, 11, 27, 43, 71, 9}},
     {8, 47, {1, 1, 7, 15, 21, 11, 81, 45}},
     {8, 49, {1, 3, 7, 3, 25, 31, 65, 79}},
     {8, 50, {1, 3, 1, 1, 19, 11, 3, 205}},
     {8, 52, {1, 1, 5, 9, 19, 21, 29, 157}},
     {8, 56, {1, 3, 7, 11, 1, 33, 89, 185}},
     {8, 67, {1, 3, 3, 3, 15, 9, 79, 71}},
     {8, 70, {1, 3, 7, 11, 15, 39, 119, 27}},
     {8, 84, {1, 1, 3, 1, 11, 31, 97, 225}},
     {8, 97, {1, 1, 1, 3, 23, 43, 57, 177}},
     {8, 103, {1, 3, 7, 7, 17, 17, 37, 71}},
     {8, 115, {1, 3, 1, 5, 27, 63, 123, 213}},
     {8, 122, {1, 1, 3, 5, 11, 43, 53, 133}},
     {9, 8, {1, 3, 5, 5, 29, 17, 47, 173, 479}},
     {9, 13, {1, 3, 3, 11, 3, 1, 109, 9, 69}},
     {9, 16, {1, 1, 1, 5, 17, 39, 23, 5, 343}},
     {9, 22, {1, 3, 1, 5, 25, 15, 31, 103, 499}},
     {9, 25, {1, 1, 1, 11, 11, 17, 63, 105, 183}},
     {9, 44, {1, 1, 5, 11, 9, 29, 97, 231, 363}},
     {9, 47, {1, 1, 5, 15, 19, 45, 41, 7, 383}},
     {9, 52, {1, 3, 7, 7, 31, 19, 83, 137, 221}},
     {9, 55, {1, 1, 1, 3, 23, 15, 111, 223, 83}},
     {9, 59, {1, 1, 5, 13, 31, 15, 55, 25, 161}},
     {9, 62, {1, 1, 3, 13, 25, 47, 39, 87, 257}}}};

/// Polynomial of degree 7: c[0] + c[1] x + ...
double polynomial(const std::array<double, 8>& c, double x) {
  double sum = 0;
  for (size_t i = c.size(); i > 0; --i) sum = sum * x + c[i - 1];
  return sum;
}

/// A permutation of 0 .. n-1 by the method of Fisher and Yates.
std::vector<std::uint32_t> permutation(std::uint64_t seed, std::uint64_t dimension, size_t n) {
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0U);
  for (size_t i = n; i > 1; --i) {
    const double u = uniform_draw(seed, dimension, i);
    std::swap(order[i - 1], order[static_cast<size_t>(u * static_cast<double>(i))]);
  }
  return order;
}

// Draws that serve different ends come from different streams.
constexpr std::uint64_t stream_of_strata = 0x5354524154410000U, stream_of_shifts = 0x5348494654000000U;

}  // namespace

double uniform_draw(std::uint64_t seed, std::uint64_t dimension, std::uint64_t run) {
  return (static_cast<double>(hashed(seed, dimension, run) >> 12) + 0.5) * 0x1p-52;
}

double normal_quantile(double probability) {
  if (!(probability > 0)) return probability == 0 ? -std::numeric_limits<double>::infinity() : std::nan("");
  if (!(probability < 1)) return probability == 1 ? std::numeric_limits<double>::infinity() : std::nan("");
  const double q = probability - 0.5;
  if (std::abs(q) <= 0.425) {
    constexpr std::array<double, 8> a = {3.3871328727963666080e0,  1.3314166789178437745e+2, 1.9715909503065514427e+3,
                                         1.3731693765509461125e+4, 4.5921953931549871457e+4, 6.7265770927008700853e+4,
                                         3.3430575583588128105e+4, 2.5090809287301226727e+3};
    constexpr std::array<double, 8> b = {1.0,
                                         4.2313330701600911252e+1,
                                         6.8718700749205790830e+2,
                                         5.3941960214247511077e+3,
                                         2.1213794301586595867e+4,
                                         3.9307895800092710610e+4,
                                         2.8729085735721942674e+4,
                                         5.2264952788528545610e+3};
    const double r = 0.180625 - q * q;
    return q * polynomial(a, r) / polynomial(b, r);
  }
  const double r = std::sqrt(-std::log(q < 0 ? probability : 1 - probability));
  double z = 0;
  if (r <= 5) {
    constexpr std::array<double, 8> c = {1.42343711074968357734e0,  4.63033784615654529590e0, 5.76949722146069140550e0,
                                         3.64784832476320460504e0,  1.27045825245236838258e0, 2.41780725177450611770e-1,
                                         2.27238449892691845833e-2, 7.74545014278341407640e-4};
    constexpr std::array<double, 8> d = {1.0,
                                         2.05319162663775882187e0,
                                         1.67638483018380384940e0,
                                         6.89767334985100004550e-1,
                                         1.48103976427480074590e-1,
                                         1.51986665636164571966e-2,
                                         5.47593808499534494600e-4,
                                         1.05075007164441684324e-9};
    z = polynomial(c, r - 1.6) / polynomial(d, r - 1.6);
  } else {
    constexpr std::array<double, 8> e = {
        6.65790464350110377720e0,  5.46378491116411436990e0,  1.78482653991729133580e0,  2.96560571828504891230e-1,
        2.65321895265761230930e-2, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7};
    constexpr std::array<double, 8> f = {1.0,
                                         5.99832206555887937690e-1,
                                         1.36929880922735805310e-1,
                                         1.48753612908506148525e-2,
                                         7.86869131145613259100e-4,
                                         1.84631831751005468180e-5,
                                         1.42151175831644588870e-7,
                                         2.04426310338993978564e-15};
    z = polynomial(e, r - 5) / polynomial(f, r - 5);
  }
  return q < 0 ? -z : z;
}

SobolSequence::SobolSequence(size_t dimensions) : directions_(dimensions) {
  require(dimensions <= most_dimensions,
          fmt::format("a Sobol sequence of {} dimensions is wanted; there are {}", dimensions, most_dimensions));
  for (size_t d = 0; d < dimensions; ++d) {
    std::array<std::uint32_t, 32>& v = directions_[d];
    if (d == 0) {
      for (size_t k = 0; k < v.size(); ++k) v[k] = 1U << (31 - k);
      continue;
    }
    const DirectionNumbers& row = joe_kuo[d - 1];
    const auto s = static_cast<size_t>(row.degree);
    for (size_t k = 0; k < v.size(); ++k) {
      if (k < s) {
        v[k] = row.first[k] << (31 - k);
        continue;
      }
      v[k] = v[k - s] ^ (v[k - s] >> s);
      for (size_t j = 1; j < s; ++j)
        if ((row.coefficients >> (s - 1 - j)) & 1U) v[k] ^= v[k - j];
    }
  }
}

std::uint32_t SobolSequence::at(std::uint64_t point, size_t dimension) const {
  std::uint32_t x = 0;
  for (size_t k = 0; k < directions_[dimension].size() && point >> k; ++k)
    if ((point >> k) & 1U) x ^= directions_[dimension][k];
  return x;
}

UnitPoints::UnitPoints(Sampling sampling, std::uint64_t seed, size_t dimensions, size_t points)
    : sampling_(sampling), seed_(seed) {
  if (sampling == Sampling::sobol) sobol_ = std::make_unique<SobolSequence>(dimensions);
  for (size_t d = 0; d < dimensions && sampling == Sampling::lhs; ++d)
    strata_.push_back(permutation(seed, stream_of_strata + d, points));
}

double UnitPoints::at(size_t point, size_t dimension) const {
  // A shift by exclusive or moves the origin away from 0, and leaves as many points in every binary box.
  if (sobol_)
    return (static_cast<double>(sobol_->at(point, dimension) ^
                                static_cast<std::uint32_t>(hashed(seed_, stream_of_shifts, dimension) >> 32)) +
            0.5) *
           0x1p-32;
  const double u = uniform_draw(seed_, dimension, point);
  if (sampling_ != Sampling::lhs) return u;
  const std::vector<std::uint32_t>& strata = strata_[dimension];
  return std::min((strata[point] + u) / static_cast<double>(strata.size()), 1 - 0x1p-53);
}

}  // namespace flexboom
