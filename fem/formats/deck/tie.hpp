#pragma once

#include "fem/mesh/mesh.hpp"

#include <Eigen/Core>

#include <array>
#include <span>
#include <vector>

namespace flexboom {

/// A face of a solid: its corners, then the nodes in the middle of its edges (01 12 20 or 01 12 23 30).
struct Face {
  std::array<int, 8> nodes{};
  int count = 0;  // 3, 4, 6 or 8

  int corners() const { return count % 3 == 0 ? 3 : 4; }
};

/// The point of a face that is nearest to a point.
struct Projection {
  int face = -1;
  double distance = 0;              // [m]
  std::array<double, 8> weights{};  // of the nodes of the face, sum 1
};

/// Finds the nearest of many faces (tree of boxes).
class FaceSearch {
 public:
  /// Both must outlive the search.
  FaceSearch(const Eigen::Matrix3Xd& nodes, std::span<const Face> faces);

  Projection nearest(const Eigen::Vector3d& point) const;

  /// Mean length of the edges [m].
  double mean_edge() const { return mean_edge_; }

 private:
  struct Box {
    Eigen::Vector3d low, high;
    int left = -1, right = -1;  // boxes
    int first = 0, last = 0;    // faces order_[first..last) of a leaf
  };
  int build(int first, int last, const std::vector<Eigen::Vector3d>& centres);
  void search(int box, const Eigen::Vector3d& point, Projection& best) const;

  const Eigen::Matrix3Xd& nodes_;
  std::span<const Face> faces_;
  std::vector<int> order_;
  std::vector<Box> boxes_;
  double mean_edge_ = 0;
};

/// Area of a face with straight edges [m^2].
double area(const Eigen::Matrix3Xd& nodes, const Face&);

/// Face `number` (from 1, in the numbering of Abaqus and CalculiX) of an element of a row of the table.
/// @returns a face without nodes if there is no such face.
Face face_of(const Element&, int number);

}  // namespace flexboom
