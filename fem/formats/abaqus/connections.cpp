#include "fem/base/at.hpp"
#include "fem/formats/abaqus/lookup.hpp"
#include "fem/formats/deck/nodes.hpp"
#include "fem/mesh/mesh_sets.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

namespace flexboom::abaqus {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double default_tolerance = 0.025;  // of the mean edge of the master surface, as CalculiX
constexpr double aligned = 1e-12;            // parts of a direction below this are round-off

/// Makes supports and connections from the lines of a deck.
class Connections {
 public:
  Connections(const Lookup& lookup, Mesh& mesh) : lookup_(lookup), deck_(lookup.deck()), mesh_(mesh) {}

  void add_all();

 private:
  struct Freedom {
    int node, component;
  };

  void add_rigid(const Rigid&);
  void add_distributing(const DistributingElements&);
  void add_mean(const DistributingConnection&);
  std::vector<double> area_weights(const SurfaceParts&) const;
  void add_mpc(const Mpc&);
  void add_pair(const Mpc&, int follower, int leader);
  void add_equation(const Equation&);
  void add_tie(const Tie&);
  void add_supports();
  void find_axes();
  Matrix3d axes_at(const Transform&, int node) const;
  Freedom freedom(const Reference&, int node, int component) const;
  void append(LinearEquation&, const Freedom&, double coefficient) const;
  void hold(const Freedom&, std::string_view where);
  bool is_idle_rotation(int node, int component, std::string_view where);

  const Lookup& lookup_;
  Deck& deck_;
  Mesh& mesh_;
  std::map<int, int> rotation_of_;       // rotation node to reference node
  std::set<int> without_rotation_node_;  // reference nodes of rigid bodies
  std::vector<char> rotates_;            // nodes with rotations
  std::vector<int> transform_;           // of each node, -1
};

void Connections::add_all() {
  for (const Rigid& rigid : deck_.rigids) add_rigid(rigid);
  for (const DistributingElements& coupling : deck_.distributing) add_distributing(coupling);
  rotates_ = nodes_that_rotate(mesh_);
  find_axes();
  for (const Mpc& mpc : deck_.mpcs) add_mpc(mpc);
  rotates_ = nodes_that_rotate(mesh_);
  for (const Tie& tie : deck_.ties) add_tie(tie);
  for (const Equation& equation : deck_.equations) add_equation(equation);
  add_supports();
}

void Connections::add_rigid(const Rigid& rigid) {
  const int reference = lookup_.node(rigid.reference);
  if (rigid.rotation)
    rotation_of_[lookup_.node(*rigid.rotation)] = reference;
  else if (rigid.surface.text.empty())
    without_rotation_node_.insert(reference);
  std::vector<int> nodes;
  SurfaceParts surface;
  if (!rigid.surface.text.empty()) {
    surface = surface_parts(lookup_, mesh_, lookup_.surface(rigid.surface));
    nodes = surface.nodes;
  } else if (!rigid.nodes.text.empty()) {
    nodes = lookup_.nodes(rigid.nodes);
  } else {
    for (const int e : lookup_.elements(rigid.elements)) {
      const ElementLine& line = deck_.elements[at(e)];
      nodes.insert(nodes.end(), lookup_.nodes_of(line), lookup_.nodes_of(line) + line.kind->nodes);
    }
    nodes = sorted_unique(std::move(nodes));
  }
  std::vector<double> weights = rigid.distributing ? area_weights(surface) : std::vector<double>(nodes.size(), 1);
  if (const auto self = std::ranges::find(nodes, reference); self != nodes.end()) {
    weights.erase(weights.begin() + (self - nodes.begin()));
    nodes.erase(self);
  }
  if (nodes.empty()) deck_.fail(rigid.at, "there are no nodes to connect with the reference node");
  if (rigid.distributing) {
    mesh_.distributing_connections.push_back({reference, std::move(nodes), std::move(weights), rigid.components});
  } else {
    mesh_.rigid_connections.push_back({reference, std::move(nodes), rigid.components});
  }
}

// Each face shares its area among its nodes. Quadratic faces give two thirds to the middles of the edges. Weights must
// be positive, and those of a uniform pressure are not.
std::vector<double> Connections::area_weights(const SurfaceParts& surface) const {
  std::vector<double> weights(surface.nodes.size(), surface.faces.empty() ? 1 : 0);
  for (const Face& face : surface.faces) {
    const double share = area(mesh_.nodes, face) / face.corners();
    const bool quadratic = face.count > face.corners();
    for (int i = 0; i < face.count; ++i) {
      const auto place = std::ranges::lower_bound(surface.nodes, face.nodes[at(i)]) - surface.nodes.begin();
      weights[static_cast<size_t>(place)] += share * (quadratic ? (i < face.corners() ? 1.0 / 3 : 2.0 / 3) : 1);
    }
  }
  return weights;
}

void Connections::add_distributing(const DistributingElements& coupling) {
  for (const int e : lookup_.elements(coupling.elements)) {
    const ElementLine& line = deck_.elements[at(e)];
    if (line.kind->role != Role::reference)
      deck_.fail(coupling.at,
                 fmt::format("*DISTRIBUTING COUPLING: element {} is a {}, not a DCOUP3D", line.at, line.kind->name));
    DistributingConnection connection;
    connection.reference = lookup_.nodes_of(line)[0];
    std::map<int, double> weights;
    for (const auto& [reference, weight] : coupling.weights) {
      for (const int node : lookup_.nodes(reference)) weights[node] = weight;
    }
    for (const auto& [node, weight] : weights) {
      connection.nodes.push_back(node);
      connection.weights.push_back(weight);
    }
    if (coupling.dialect == Dialect::calculix)
      add_mean(connection);
    else
      mesh_.distributing_connections.push_back(std::move(connection));
  }
}

/// CalculiX: the displacement of the reference node is the weighted mean, its rotations are left alone.
void Connections::add_mean(const DistributingConnection& c) {
  for (int k = 0; k < 3; ++k) {
    LinearEquation equation{{{c.reference, k, std::accumulate(c.weights.begin(), c.weights.end(), 0.0)}}};
    for (size_t i = 0; i < c.nodes.size(); ++i) equation.terms.push_back({c.nodes[i], k, -c.weights[i]});
    mesh_.equations.push_back(std::move(equation));
  }
}

/// Whether a degree of freedom 4 to 6 of a node is that of a rigid body whose rotations CalculiX keeps elsewhere.
bool Connections::is_idle_rotation(int node, int component, std::string_view where) {
  return component >= 3 && without_rotation_node_.contains(node) &&
         deck_.dialect(where,
                       "degrees of freedom 4 to 6 of the reference node of a *RIGID BODY turn it in Abaqus and do "
                       "nothing in CalculiX, which has a ROT NODE for them") == Dialect::calculix;
}

void Connections::find_axes() {
  transform_.assign(rotates_.size(), -1);
  for (size_t i = 0; i < deck_.transforms.size(); ++i) {
    for (const int node : lookup_.nodes(deck_.transforms[i].nodes)) transform_[at(node)] = static_cast<int>(i);
  }
}

Matrix3d Connections::axes_at(const Transform& transform, int node) const {
  Matrix3d axes;
  if (!transform.cylindrical) {
    axes.col(0) = transform.a.normalized();
    axes.col(2) = transform.a.cross(transform.b).normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    return axes;
  }
  axes.col(2) = (transform.b - transform.a).normalized();
  const Vector3d arm = mesh_.nodes.col(node) - transform.a;
  const Vector3d radial = arm - axes.col(2) * axes.col(2).dot(arm);
  if (radial.norm() <= aligned * std::max(arm.norm(), transform.b.norm()))
    deck_.fail(transform.at,
               fmt::format("*TRANSFORM: node {} lies on the axis and has no radial direction", mesh_.node_label(node)));
  axes.col(0) = radial.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

/// Freedoms 1 to 3 of a rotation node are 4 to 6 of its reference node.
Connections::Freedom Connections::freedom(const Reference& where, int node, int component) const {
  const auto rotation = rotation_of_.find(node);
  if (rotation == rotation_of_.end()) return {node, component};
  if (component >= 3)
    deck_.fail(where.text, fmt::format("node {} is a ROT NODE: its degrees of freedom 1 to 3 are rotations",
                                       mesh_.node_label(node)));
  return {rotation->second, component + 3};
}

/// A component in the axes of its node, by components in the axes of the mesh.
void Connections::append(LinearEquation& equation, const Freedom& freedom, double coefficient) const {
  const int transform = transform_[at(freedom.node)];
  if (transform < 0) {
    equation.terms.push_back({freedom.node, freedom.component, coefficient});
    return;
  }
  const Vector3d direction = axes_at(deck_.transforms[at(transform)], freedom.node).col(freedom.component % 3);
  const int first = freedom.component < 3 ? 0 : 3;
  for (int k = 0; k < 3; ++k) {
    if (std::abs(direction(k)) > aligned)
      equation.terms.push_back({freedom.node, first + k, coefficient * direction(k)});
  }
}

void Connections::add_equation(const Equation& lines) {
  std::vector<std::vector<int>> nodes;
  size_t count = 1;
  for (const Equation::Term& term : lines.terms) {
    nodes.push_back(lookup_.nodes_for_pairs(term.node));
    if (nodes.back().size() == 1) continue;
    if (nodes.back().empty() || (count > 1 && nodes.back().size() != count))
      deck_.fail(term.node.text, "the node sets of an equation must have equally many nodes, or one");
    count = nodes.back().size();
  }
  for (size_t i = 0; i < count; ++i) {
    LinearEquation equation;
    for (size_t t = 0; t < lines.terms.size(); ++t) {
      const Equation::Term& term = lines.terms[t];
      if (term.coefficient == 0) continue;
      const Freedom follows = freedom(term.node, nodes[t][nodes[t].size() == 1 ? 0 : i], term.component - 1);
      if (follows.component >= 3 && !rotates_[at(follows.node)])
        deck_.fail(term.node.text, fmt::format("node {} of the equation has no rotations (degrees of freedom 4 to 6)",
                                               mesh_.node_label(follows.node)));
      if (is_idle_rotation(follows.node, follows.component, term.node.text) && !rotation_of_.contains(nodes[t][0]))
        deck_.fail(term.node.text, "CalculiX has the rotations of a rigid body in the ROT NODE alone; give it one");
      append(equation, follows, term.coefficient);
    }
    mesh_.equations.push_back(std::move(equation));
  }
}

void Connections::add_mpc(const Mpc& mpc) {
  const std::vector<int> leaders = lookup_.nodes_for_pairs(mpc.leader);
  std::vector<int> followers =
      leaders.size() == 1 ? lookup_.nodes(mpc.follower) : lookup_.nodes_for_pairs(mpc.follower);
  if (leaders.empty() || followers.empty() || (leaders.size() != 1 && leaders.size() != followers.size()))
    deck_.fail(mpc.at, fmt::format("*MPC: {} nodes cannot follow {}", followers.size(), leaders.size()));
  if (mpc.type == "BEAM" && leaders.size() == 1) {
    std::erase(followers, leaders[0]);
    if (followers.empty()) deck_.fail(mpc.at, "*MPC: a node cannot follow itself");
    mesh_.rigid_connections.push_back({leaders[0], std::move(followers), all_components});
    return;
  }
  for (size_t i = 0; i < followers.size(); ++i) add_pair(mpc, followers[i], leaders[leaders.size() == 1 ? 0 : i]);
}

void Connections::add_pair(const Mpc& mpc, int follower, int leader) {
  if (follower == leader)
    deck_.fail(mpc.at, fmt::format("*MPC: node {} cannot follow itself", mesh_.node_label(leader)));
  if (mpc.type == "BEAM") {
    mesh_.rigid_connections.push_back({leader, {follower}, all_components});
    return;
  }
  const Vector3d arm = mesh_.nodes.col(leader) - mesh_.nodes.col(follower);
  if (mpc.type == "LINK" && arm.norm() > 0) {  // the distance stays: arm . (u_leader - u_follower) = 0
    LinearEquation equation;
    for (int k = 0; k < 3; ++k) {
      if (arm(k) == 0) continue;
      equation.terms.push_back({follower, k, -arm(k) / arm.norm()});
      equation.terms.push_back({leader, k, arm(k) / arm.norm()});
    }
    mesh_.equations.push_back(std::move(equation));
    return;
  }
  const bool turn = mpc.type == "TIE" && rotates_[at(follower)] && rotates_[at(leader)];
  for (int k = 0; k < (turn ? 6 : 3); ++k) mesh_.equations.push_back({{{follower, k, 1}, {leader, k, -1}}});
}

void Connections::add_tie(const Tie& tie) {
  const SurfaceParts master = surface_parts(lookup_, mesh_, lookup_.surface(tie.master));
  if (master.faces.empty()) deck_.fail(tie.master.text, "the master surface of *TIE must have faces (TYPE=ELEMENT)");
  const SurfaceParts slave = surface_parts(lookup_, mesh_, lookup_.surface(tie.slave));
  const FaceSearch search(mesh_.nodes, master.faces);
  const double tolerance = tie.tolerance.value_or(default_tolerance * search.mean_edge());
  int moved = 0;
  for (const int node : slave.nodes) {
    if (std::ranges::binary_search(master.nodes, node)) continue;
    const Projection found = search.nearest(mesh_.nodes.col(node));
    if (!(found.distance <= tolerance))
      deck_.fail(tie.at, fmt::format("*TIE: slave node {} is {:.4g} from the master surface; the position tolerance is "
                                     "{:.4g}",
                                     mesh_.node_label(node), found.distance, tolerance));
    const Face& face = master.faces[at(found.face)];
    Vector3d foot = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      LinearEquation equation{{{node, k, 1}}};
      for (int i = 0; i < face.count; ++i) {
        const double weight = found.weights[at(i)];
        foot(k) += weight * mesh_.nodes(k, face.nodes[at(i)]);
        if (std::abs(weight) > aligned) equation.terms.push_back({face.nodes[at(i)], k, -weight});
      }
      mesh_.equations.push_back(std::move(equation));
    }
    if (!tie.adjust || found.distance <= aligned * search.mean_edge()) continue;
    mesh_.nodes.col(node) = foot;
    ++moved;
  }
  if (moved > 0)
    deck_.notes.add(fmt::format("*TIE: {} slave nodes were moved onto the master surface (ADJUST)", moved));
}

void Connections::hold(const Freedom& freedom, std::string_view where) {
  LinearEquation equation;
  append(equation, freedom, 1);
  if (equation.terms.empty()) deck_.fail(where, "this support has no direction");
  if (equation.terms.size() > 1) {
    mesh_.equations.push_back(std::move(equation));
    return;
  }
  Support support{freedom.node, {}};
  support.components[at(equation.terms[0].component)] = true;
  mesh_.supports.push_back(support);
}

void Connections::add_supports() {
  std::vector<Components> held(rotates_.size(), Components{});
  std::vector<std::string_view> where(rotates_.size());
  const std::vector<char> used = nodes_in_use(mesh_);  // supports of others are passed over
  for (const Boundary& boundary : deck_.boundaries) {
    for (const int node : lookup_.nodes(boundary.nodes)) {
      for (int component = boundary.first - 1; component < boundary.last; ++component) {
        if (component >= 3 && rotation_of_.contains(node)) continue;
        if (is_idle_rotation(node, component, boundary.at)) continue;
        const Freedom follows = freedom(boundary.nodes, node, component);
        if (follows.component >= 3 && !rotates_[at(follows.node)]) continue;  // of a solid, as CalculiX does
        held[at(follows.node)][at(follows.component)] = true;
        where[at(follows.node)] = boundary.at;
      }
    }
  }
  int idle = 0;
  for (size_t node = 0; node < held.size(); ++node) {
    const Components& c = held[node];
    if (c == Components{}) continue;
    if (!used[node]) {
      ++idle;
      continue;
    }
    const bool turned = transform_[node] >= 0;
    Support support{static_cast<int>(node), {}};
    for (size_t first : {size_t{0}, size_t{3}}) {  // all of three directions are held in any axes
      const bool all = c[first] && c[first + 1] && c[first + 2];
      for (size_t k = first; k < first + 3; ++k) {
        if (!c[k]) continue;
        if (all || !turned)
          support.components[k] = true;
        else
          hold({static_cast<int>(node), static_cast<int>(k)}, where[node]);
      }
    }
    if (support.components != Components{}) mesh_.supports.push_back(support);
  }
  if (idle > 0) deck_.notes.add(fmt::format("supports of {} nodes that belong to nothing were left out", idle));
}

}  // namespace

void add_connections(const Lookup& lookup, Mesh& mesh) { Connections(lookup, mesh).add_all(); }

}  // namespace flexboom::abaqus
