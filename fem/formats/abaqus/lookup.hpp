#pragma once

#include "fem/formats/abaqus/deck.hpp"
#include "fem/formats/deck/tie.hpp"

#include <map>
#include <string>
#include <vector>

namespace flexboom::abaqus {

/// What the numbers and names of a deck stand for, once all of it has been read.
class Lookup {
 public:
  /// Numbers nodes and elements and collects the sets. @throws InputError at what is defined twice or missing.
  explicit Lookup(Deck&);

  Deck& deck() const { return deck_; }

  /// The node of a number, or of a set of one.
  int node(const Reference&) const;
  /// Of a number or a set, ascending.
  std::vector<int> nodes(const Reference&) const;
  /// The same by their numbers, where they are paired with those of another. @throws InputError where the deck asks for
  /// another order.
  std::vector<int> nodes_for_pairs(const Reference&) const;
  /// Indices into Deck::elements of a number or a set, ascending.
  std::vector<int> elements(const Reference&) const;
  const Surface& surface(const Reference&) const;

  /// Nodes of the element lines of Deck::elements.
  const int* nodes_of(const ElementLine& line) const { return &element_nodes_[line.first_node]; }

  const std::map<std::string, std::vector<int>>& node_sets() const { return node_sets_; }
  const std::map<std::string, std::vector<int>>& element_sets() const { return element_sets_; }

  // Filled as the mesh is made: the first of its elements that a line became (-1: none), and their number.
  std::vector<int> mesh_element, mesh_elements;

 private:
  void number_elements();
  void number_element_nodes();
  void drop_repeated_elements();
  std::vector<int> members(const Set&, const LabelIndex&, std::string_view kind) const;

  Deck& deck_;
  std::vector<long> element_labels_;
  LabelIndex element_index_{{}};
  std::vector<int> element_nodes_;
  std::map<std::string, std::vector<int>> node_sets_, element_sets_;
};

/// Faces and nodes of a surface, of the mesh that the deck became.
struct SurfaceParts {
  std::vector<Face> faces;
  std::vector<int> nodes;  // ascending, also those of the faces
};
SurfaceParts surface_parts(const Lookup&, const Mesh&, const Surface&);

/// Supports, connections, equations and ties of a deck.
void add_connections(const Lookup&, Mesh&);

}  // namespace flexboom::abaqus
