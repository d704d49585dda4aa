#pragma once

#include "fem/formats/abaqus/dialect.hpp"
#include "fem/formats/abaqus/keywords.hpp"
#include "fem/formats/common/mesh_file.hpp"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// A deck as it was written, before numbers and names are looked up: they may be used before they are defined.
namespace flexboom::abaqus {

inline constexpr long largest_label = 999'999'999'999;  // 12 digits: more is a fault of writing

enum class Role { solid, beam, mass, reference, left_out };  // reference: of DISTRIBUTING COUPLING

struct ElementKind {
  std::string_view name;  // "C3D8"
  std::string_view row;   // of the table of elements
  int nodes;
  Role role;
  std::string_view note = {};  // where it is not what the programs of decks compute
};

/// Numbers of nodes and elements are negative where they belong to the assembly of a deck with a part.
struct ElementLine {
  long label = 0;
  const ElementKind* kind = nullptr;
  size_t first_node = 0;  // in Deck::element_nodes
  std::string_view at;
  int section = -1;  // in Deck::sections
};

/// A number or the name of a set, and whether it stood in a part.
struct Reference {
  std::string_view text;
  bool in_part = false;
};

struct LabelRange {
  long first, last, step;
  bool generated;  // numbers that do not exist are passed over
  std::string_view at;
};

/// Of nodes or elements.
struct Set {
  std::string name;
  std::vector<LabelRange> ranges;
  std::vector<Reference> element_sets;  // of a node set: the nodes of their elements
  bool is_unsorted = false;             // its members have an order of their own
};
using Sets = std::map<std::string, Set>;  // by key

struct Surface {
  struct Part {
    Reference where;
    int face;  // from 1; 0: nodes
    std::string_view at;
  };
  std::string name;
  std::vector<Part> parts;
  std::string_view at;
};

/// By temperature, ascending; one row where it does not count.
struct ElasticRow {
  double temperature, E, nu;
};
struct DensityRow {
  double temperature, rho;
};
struct MaterialLines {
  std::string name;
  std::vector<ElasticRow> elastic;
  std::vector<DensityRow> density;

  bool depends_on_temperature() const { return elastic.size() > 1 || density.size() > 1; }
};

struct InitialTemperature {
  Reference nodes;
  double temperature;
};

struct SectionLine {
  Role role = Role::solid;
  Reference elements;
  std::string material;  // key; empty: the beam's own
  BeamProperty beam;
  std::string_view at;
};

/// Degrees of freedom first to last of nodes, from 1.
struct Boundary {
  Reference nodes;
  int first, last;
  std::string_view at;
};

struct Rigid {
  Reference nodes, elements;  // either, or a surface
  Reference surface;
  Reference reference;
  std::optional<Reference> rotation;  // node of which 1 to 3 are the rotations
  Components components = all_components;
  bool distributing = false;
  std::string_view at;
};

struct DistributingElements {
  Reference elements;
  Dialect dialect;
  std::vector<std::pair<Reference, double>> weights;
  std::string_view at;
};

struct Equation {
  struct Term {
    Reference node;
    int component;  // from 1
    double coefficient;
  };
  std::vector<Term> terms;
  std::string_view at;
};

struct Mpc {
  std::string type;
  Reference follower, leader;
  std::string_view at;
};

struct Tie {
  Reference slave, master;
  std::optional<double> tolerance;
  bool adjust = true;
  std::string_view at;
};

struct Transform {
  Reference nodes;
  bool cylindrical;
  Eigen::Vector3d a, b;
  std::string_view at;
};

/// Of a part, which has axes of its own.
struct Instance {
  std::string name;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  // directions of the part -> of the assembly
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();

  /// Where a point of the part is.
  Eigen::Vector3d place(const Eigen::Vector3d& point) const { return pivot + turn * (point + shift - pivot); }
};

struct Deck {
  Deck(std::string_view text, const std::string& file, const ReadOptions& given)
      : lines(text, file), options(given), text_(text), file_(file) {}

  [[noreturn]] void fail(std::string_view at, const std::string& message) const { lines.text().fail(at, message); }

  /// The program that the deck is for, asked where a keyword means something else to each.
  /// @throws InputError with the difference where the deck does not tell.
  Dialect dialect(std::string_view at, std::string_view difference);

  /// A field as a number. @throws InputError naming `what` should be there.
  double real(std::string_view field, std::string_view what);
  /// Field i of a line, zero where it is empty or not there.
  double real_or_zero(const std::vector<std::string_view>& fields, size_t i, std::string_view what);

  /// A number of a node or element where the deck stands. @throws InputError unless it is positive.
  long label(std::string_view field, std::string_view what) const;
  Reference reference(std::string_view text) const { return {text, in_part}; }

  /// Key of a name in a map of sets or surfaces.
  std::string key(std::string_view name, bool part) const;
  std::string key(const Reference& name) const { return key(name.text, name.in_part); }
  /// Number of a reference, if it is one.
  std::optional<long> number(const Reference&) const;

  Lines lines;
  ReadOptions options;
  Notes notes;
  bool has_long_number = false;  // one that CalculiX cuts off

  DeckNodes nodes;
  std::vector<ElementLine> elements;
  std::vector<long> element_nodes;
  Sets node_sets, element_sets;
  size_t looked_up = 0;       // members of sets made and handed out
  long generated = 0;         // numbers that GENERATE went through
  size_t copied_members = 0;  // of sets into sets
  std::map<std::string, Surface> surfaces;
  std::map<std::string, MaterialLines> materials;
  MaterialLines* material = nullptr;  // the one that *ELASTIC and *DENSITY belong to
  std::vector<SectionLine> sections;
  std::vector<std::pair<Reference, double>> masses;  // of MASS elements
  std::vector<Boundary> boundaries;
  std::vector<Rigid> rigids;
  std::vector<DistributingElements> distributing;
  std::vector<Equation> equations;
  std::vector<Mpc> mpcs;
  std::vector<Tie> ties;
  std::vector<Transform> transforms;
  std::vector<InitialTemperature> initial_temperatures;
  std::string_view temperature_file;  // an initial temperature that is in another file
  std::string_view step_temperature;  // a *TEMPERATURE of a step

  bool has_part = false, in_part = false;
  std::optional<Instance> instance;

  bool in_step = false, cleared = false;         // cleared: OP=NEW of this step has been heeded
  bool perturbation = false, nonlinear = false;  // of this step
  std::string_view preload, nonlinear_preload;   // the last static step, the last one with NLGEOM
  bool frequencies = false;                      // a step asks for them
  bool finished = false;                         // and has ended
  std::optional<int> modes;

 private:
  std::string_view text_;
  std::string file_;
  std::optional<DialectSigns> signs_;  // once they are asked for
};

// Readers of keywords, one each; the table in read_abaqus.cpp names them.
using Read = void (*)(Deck&, const Keyword&);
void read_node(Deck&, const Keyword&);
void read_element(Deck&, const Keyword&);
void read_node_set(Deck&, const Keyword&);
void read_element_set(Deck&, const Keyword&);
void read_surface(Deck&, const Keyword&);
void read_part(Deck&, const Keyword&);
void read_end_part(Deck&, const Keyword&);
void read_instance(Deck&, const Keyword&);
void read_end_instance(Deck&, const Keyword&);
void read_material(Deck&, const Keyword&);
void read_elastic(Deck&, const Keyword&);
void read_density(Deck&, const Keyword&);
void read_solid_section(Deck&, const Keyword&);
void read_shell_section(Deck&, const Keyword&);
void read_beam_section(Deck&, const Keyword&);
void read_beam_general_section(Deck&, const Keyword&);
void read_mass(Deck&, const Keyword&);
void read_boundary(Deck&, const Keyword&);
void read_rigid_body(Deck&, const Keyword&);
void read_coupling(Deck&, const Keyword&);
void read_distributing_coupling(Deck&, const Keyword&);
void read_equation(Deck&, const Keyword&);
void read_mpc(Deck&, const Keyword&);
void read_tie(Deck&, const Keyword&);
void read_transform(Deck&, const Keyword&);
void read_step(Deck&, const Keyword&);
void read_end_step(Deck&, const Keyword&);
void read_static(Deck&, const Keyword&);
void read_frequency(Deck&, const Keyword&);
void read_initial_conditions(Deck&, const Keyword&);
void read_temperature(Deck&, const Keyword&);

/// Mesh of a deck that has been read.
MeshFile mesh_of(Deck&);

}  // namespace flexboom::abaqus
