#include "fem/booms/boom_profile.hpp"
#include "fem/mesh/shape_functions.hpp"

#include "fem/mesh/section_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <utility>

namespace flexboom {
namespace {

using Corners = std::array<int, 4>;  // counter-clockwise in (tau, x)

class Builder {
 public:
  Builder(const std::vector<BoomLayer>& layers, const ProfileOptions& options)
      : layers_(layers),
        options_(options),
        points_(((lobatto_basis(options.order).nodes().array() + 1) / 2).matrix()) {}

  Profile build() {
    add_vertices();
    for (size_t l = 0; l < layers_.size(); ++l) add_layer(static_cast<int>(l));
    for (const auto& [corners, layer] : cells_) add_quad(corners, layer);
    add_axis();
    return std::move(profile_);
  }

 private:
  int add(double tau, double x, int run) {
    profile_.nodes.push_back({tau, x, run});
    return static_cast<int>(profile_.nodes.size()) - 1;
  }

  double tau_of(int column) const {
    const auto [ring, inside] = std::div(column, static_cast<int>(options_.ring_cuts.size()));
    return ring + (inside == 0 ? 0 : options_.ring_cuts[static_cast<size_t>(inside) - 1]);
  }

  // Points of column lines and planes. A plane between two runs has those of the wider one.
  void add_vertices() {
    for (size_t plane = 0; plane <= layers_.size(); ++plane) {
      const BoomLayer& below = layers_[plane == 0 ? 0 : plane - 1];
      const BoomLayer& above = layers_[std::min(plane, layers_.size() - 1)];
      const BoomLayer& wide = below.columns > above.columns ? below : above;
      std::vector<int>& line = vertices_.emplace_back();
      for (int c = 0; c <= wide.columns; ++c) {
        line.push_back(add(tau_of(c), plane == 0 ? below.from : below.to, wide.run));
      }
    }
  }

  int vertex(int column, int plane) const { return vertices_[static_cast<size_t>(plane)][static_cast<size_t>(column)]; }

  void add_layer(int layer) {
    for (int c = 0; c < layers_[static_cast<size_t>(layer)].columns; ++c) {
      const std::array<ProfileCorner, 4> places = {{{c, layer}, {c + 1, layer}, {c + 1, layer + 1}, {c, layer + 1}}};
      const auto* const singular = std::find_if(places.begin(), places.end(), [&](const ProfileCorner& p) {
        return options_.levels > 0 && std::any_of(options_.corners.begin(), options_.corners.end(), [&](const auto& q) {
                 return p.column == q.column && p.plane == q.plane;
               });
      });
      const auto first = singular == places.end() ? 0 : singular - places.begin();
      Corners corners{};
      for (size_t i = 0; i < 4; ++i) {
        const ProfileCorner& place = places[(i + static_cast<size_t>(first)) % 4];
        corners[i] = vertex(place.column, place.plane);
      }
      if (singular == places.end()) {
        cells_.emplace_back(corners, layer);
      } else {
        refine(corners, layer);
      }
    }
  }

  // Toward corner 0. Edge points are shared with whoever is refined toward the same corner along the same edge.
  void refine(Corners q, int layer) {
    const Corners whole = q;
    for (int level = 0; level < options_.levels; ++level) {
      const double f = std::pow(options_.factor, level + 1);
      const int run = layers_[static_cast<size_t>(layer)].run;
      const int ab = edge_point(whole[0], whole[1], f, level, run);
      const int ad = edge_point(whole[0], whole[3], f, level, run);
      const ProfileNode a = node(whole[0]), b = node(whole[1]), c = node(whole[2]), d = node(whole[3]);
      const auto bilinear = [f](double va, double vb, double vc, double vd) {
        return std::lerp(std::lerp(va, vb, f), std::lerp(vd, vc, f), f);
      };
      const int inner = add(bilinear(a.tau, b.tau, c.tau, d.tau), bilinear(a.x, b.x, c.x, d.x), run);
      cells_.push_back({{ab, q[1], q[2], inner}, layer});
      cells_.push_back({{inner, q[2], q[3], ad}, layer});
      q = {q[0], ab, inner, ad};
    }
    cells_.emplace_back(q, layer);
  }

  int edge_point(int corner, int end, double f, int level, int run) {
    const auto [found, is_new] = edge_points_.try_emplace({corner, end, level}, 0);
    if (is_new) {
      const ProfileNode a = node(corner), b = node(end);
      found->second = add(std::lerp(a.tau, b.tau, f), std::lerp(a.x, b.x, f), run);
    }
    return found->second;
  }

  // Nodes on an edge from vertex a to vertex b, ends included.
  std::vector<int> edge(int a, int b, int run) {
    const int p = options_.order;
    std::vector<int>& inside = edges_[std::minmax(a, b)];
    if (inside.empty()) {
      const ProfileNode from = node(std::min(a, b)), to = node(std::max(a, b));
      for (int i = 1; i < p; ++i) {
        inside.push_back(add(std::lerp(from.tau, to.tau, points_(i)), std::lerp(from.x, to.x, points_(i)), run));
      }
    }
    std::vector<int> all = {std::min(a, b)};
    all.insert(all.end(), inside.begin(), inside.end());
    all.push_back(std::max(a, b));
    if (a > b) std::reverse(all.begin(), all.end());
    return all;
  }

  void add_quad(const Corners& q, int layer) {
    const int p = options_.order;
    const size_t n = static_cast<size_t>(p) + 1;
    const int run = layers_[static_cast<size_t>(layer)].run;
    const std::vector<int> bottom = edge(q[0], q[1], run), top = edge(q[3], q[2], run);
    const std::vector<int> left = edge(q[0], q[3], run), right = edge(q[1], q[2], run);
    ProfileQuad quad{std::vector<int>(n * n), layer};
    for (size_t j = 0; j < n; ++j) {
      for (size_t i = 0; i < n; ++i) {
        int& id = quad.nodes[i + n * j];
        if (j == 0 || j == n - 1) {
          id = (j == 0 ? bottom : top)[i];
        } else if (i == 0 || i == n - 1) {
          id = (i == 0 ? left : right)[j];
        } else {
          const double s = points_(static_cast<Eigen::Index>(i)), t = points_(static_cast<Eigen::Index>(j));
          const ProfileNode a = node(q[0]), b = node(q[1]), c = node(q[2]), d = node(q[3]);
          id = add(std::lerp(std::lerp(a.tau, b.tau, s), std::lerp(d.tau, c.tau, s), t),
                   std::lerp(std::lerp(a.x, b.x, s), std::lerp(d.x, c.x, s), t), run);
        }
      }
    }
    for (const int id : quad.nodes) mark_side(id, layer);
    profile_.quads.push_back(std::move(quad));
  }

  void mark_side(int id, int layer) {
    // Lines keep their tau to the last bit: lerp of equal ends is exact.
    if (node(id).tau == tau_of(layers_[static_cast<size_t>(layer)].columns)) profile_.side.push_back(id);
  }

  void add_axis() {
    for (size_t l = 0; l < layers_.size(); ++l) {
      const int plane = static_cast<int>(l);
      const std::vector<int> line = edge(vertex(0, plane), vertex(0, plane + 1), layers_[l].run);
      for (const int id : line) mark_side(id, plane);
      profile_.axis.insert(profile_.axis.end(), line.begin() + (l > 0), line.end());
    }
    std::sort(profile_.side.begin(), profile_.side.end());
    profile_.side.erase(std::unique(profile_.side.begin(), profile_.side.end()), profile_.side.end());
  }

  ProfileNode node(int i) const { return profile_.nodes[static_cast<size_t>(i)]; }

  const std::vector<BoomLayer>& layers_;
  const ProfileOptions& options_;
  Eigen::VectorXd points_;  // on [0, 1]
  Profile profile_;
  std::vector<std::vector<int>> vertices_;  // [plane][column]
  std::vector<std::pair<Corners, int>> cells_;
  std::map<std::array<int, 3>, int> edge_points_;
  std::map<std::pair<int, int>, std::vector<int>> edges_;
};

}  // namespace

Profile make_profile(const std::vector<BoomLayer>& layers, const ProfileOptions& options) {
  return Builder(layers, options).build();
}

}  // namespace flexboom
