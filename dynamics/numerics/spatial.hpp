#pragma once

#include <Eigen/Core>

#include <array>
#include <concepts>

namespace flexboom::spatial {

// Three-vectors and 3 x 3 matrices over any scalar (double or Dual), for the inner loop only; everything else uses
// Eigen. Constants stay double, so a product with a constant costs no derivative arithmetic it does not need.

template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  Vec3& operator+=(const Vec3& b) {
    x += b.x, y += b.y, z += b.z;
    return *this;
  }
  Vec3& operator-=(const Vec3& b) {
    x -= b.x, y -= b.y, z -= b.z;
    return *this;
  }
};

template <class T>
Vec3<T> operator+(Vec3<T> a, const Vec3<T>& b) {
  return a += b;
}
template <class T>
Vec3<T> operator-(Vec3<T> a, const Vec3<T>& b) {
  return a -= b;
}
template <class T>
Vec3<T> operator-(const Vec3<T>& a) {
  return {-a.x, -a.y, -a.z};
}
template <class S, class T>
auto operator*(const S& s, const Vec3<T>& a) {
  return Vec3<decltype(s * a.x)>{s * a.x, s * a.y, s * a.z};
}
template <class S, class T>
auto dot(const Vec3<S>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class S, class T>
auto cross(const Vec3<S>& a, const Vec3<T>& b) {
  return Vec3<decltype(a.x * b.x)>{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Symmetric 3 x 3.
template <class T>
struct Sym3 {
  T xx{}, yy{}, zz{}, xy{}, yz{}, zx{};

  Sym3& operator+=(const Sym3& b) {
    xx += b.xx, yy += b.yy, zz += b.zz, xy += b.xy, yz += b.yz, zx += b.zx;
    return *this;
  }
};

template <class S, class T>
auto operator*(const S& s, const Sym3<T>& a) {
  return Sym3<decltype(s * a.xx)>{s * a.xx, s * a.yy, s * a.zz, s * a.xy, s * a.yz, s * a.zx};
}
template <class S, class T>
auto operator*(const Sym3<S>& a, const Vec3<T>& b) {
  return Vec3<decltype(a.xx * b.x)>{a.xx * b.x + a.xy * b.y + a.zx * b.z, a.xy * b.x + a.yy * b.y + a.yz * b.z,
                                    a.zx * b.x + a.yz * b.y + a.zz * b.z};
}
/// a -= s v v^T.
template <class T>
void subtract_dyad(Sym3<T>& a, const T& s, const Vec3<T>& v) {
  const Vec3<T> sv = s * v;
  a.xx -= sv.x * v.x, a.yy -= sv.y * v.y, a.zz -= sv.z * v.z;
  a.xy -= sv.x * v.y, a.yz -= sv.y * v.z, a.zx -= sv.z * v.x;
}

/// General 3 x 3 by rows.
template <class T>
struct Mat3 {
  std::array<Vec3<T>, 3> row;
};

template <class S, class T>
auto operator*(const Mat3<S>& a, const Vec3<T>& b) {
  return Vec3<decltype(a.row[0].x * b.x)>{dot(a.row[0], b), dot(a.row[1], b), dot(a.row[2], b)};
}
template <class S, class T>
auto transposed_product(const Mat3<S>& a, const Vec3<T>& b) {
  return Vec3<decltype(a.row[0].x * b.x)>{a.row[0].x * b.x + a.row[1].x * b.y + a.row[2].x * b.z,
                                          a.row[0].y * b.x + a.row[1].y * b.y + a.row[2].y * b.z,
                                          a.row[0].z * b.x + a.row[1].z * b.y + a.row[2].z * b.z};
}

/// Its rows are the columns of `a`.
template <class T>
Mat3<T> transposed(const Mat3<T>& a) {
  const Vec3<T>&x = a.row[0], &y = a.row[1], &z = a.row[2];
  return {{Vec3<T>{x.x, y.x, z.x}, Vec3<T>{x.y, y.y, z.y}, Vec3<T>{x.z, y.z, z.z}}};
}

/// Component of a vector, or of a symmetric matrix in the order of its members, by number.
template <class T, std::integral I>
T& component(Vec3<T>& a, I i) {
  static constexpr T Vec3<T>::*entries[] = {&Vec3<T>::x, &Vec3<T>::y, &Vec3<T>::z};
  return a.*entries[i];
}
template <class T, std::integral I>
T& component(Sym3<T>& a, I i) {
  using S = Sym3<T>;
  static constexpr T S::*entries[] = {&S::xx, &S::yy, &S::zz, &S::xy, &S::yz, &S::zx};
  return a.*entries[i];
}

inline Vec3<double> vec3(const Eigen::Vector3d& a) { return {a.x(), a.y(), a.z()}; }
inline Eigen::Vector3d eigen(const Vec3<double>& a) { return {a.x, a.y, a.z}; }
inline Mat3<double> mat3(const Eigen::Matrix3d& a) {
  return {{vec3(a.row(0).transpose()), vec3(a.row(1).transpose()), vec3(a.row(2).transpose())}};
}
inline Eigen::Matrix3d eigen(const Mat3<double>& a) {
  return Eigen::Matrix3d{
      {a.row[0].x, a.row[0].y, a.row[0].z}, {a.row[1].x, a.row[1].y, a.row[1].z}, {a.row[2].x, a.row[2].y, a.row[2].z}};
}
inline Sym3<double> sym3(const Eigen::Matrix3d& a) { return {a(0, 0), a(1, 1), a(2, 2), a(0, 1), a(1, 2), a(2, 0)}; }
inline Eigen::Matrix3d eigen(const Sym3<double>& a) {
  return Eigen::Matrix3d{{a.xx, a.xy, a.zx}, {a.xy, a.yy, a.yz}, {a.zx, a.yz, a.zz}};
}

}  // namespace flexboom::spatial
