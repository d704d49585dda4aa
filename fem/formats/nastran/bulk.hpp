#pragma once

#include "fem/formats/common/mesh_file.hpp"
#include "fem/formats/nastran/cards.hpp"

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

// Bulk data as they were written, before ids are looked up: cards come in any order.
namespace flexboom::nastran {

struct Grid {
  long system;  // its coordinates
  std::string_view at;
};

struct System {
  char kind;  // R, C, S; else not understood
  long reference;
  Eigen::Vector3d origin, z, xz;
  std::string_view at;
};

struct SolidLine {
  long label, property;
  std::string_view row;  // of the table of elements
  size_t first_node;     // in Bulk::element_nodes
  int nodes;
  std::string_view at;
};

struct BeamLine {
  bool is_bar;  // CBAR, else CBEAM
  long label, property;
  std::array<long, 2> nodes;
  Eigen::Vector3d direction;  // y axis
  long direction_node = 0;    // or a node in it
  std::string_view at;
};

struct SolidPropertyLine {
  long material;
  std::string_view at;
};

struct BeamPropertyLine {
  bool is_of_bars;  // PBAR and PBARL, else PBEAM and PBEAML
  long material;
  SectionShape shape;
  bool shear;        // false: rigid in shear
  double line_mass;  // nonstructural, per length
  std::string_view at;
};

struct MaterialLine {
  Material of_solids, of_bars;  // by E and NU; by E and G
  std::string refusal;          // why it cannot be used, empty if it can
  std::string_view at;
};

/// Nodes of ids first to last; of a range those that exist.
struct IdRange {
  long first, last;
  std::string_view at;
};

struct SupportLine {
  std::vector<IdRange> nodes;
  std::vector<int> components;
};

struct MpcLine {
  struct Term {
    long node;
    int component;
    double coefficient;
    std::string_view at;
  };
  std::vector<Term> terms;
};

struct RigidLine {
  std::string name;  // "RBE2_5"
  long reference;
  std::vector<IdRange> nodes;
  Components components;
  std::vector<double> weights;  // RBE3: one per range
  std::string_view at;
};

struct MassLine {
  long node;
  NodalBody body;
  bool absolute;  // the offset is the place of the mass centre
  std::string_view at;
};

struct Bulk {
  Bulk(std::string_view text, const std::string& file, const std::optional<Material>& given)
      : cards(text, file), material(given) {}

  [[noreturn]] void fail(std::string_view at, const std::string& message) const { cards.fail(at, message); }

  Cards cards;
  Notes notes;
  std::optional<Material> material;  // of everything, instead of the file's

  DeckNodes nodes;
  std::vector<Grid> grids;  // as the nodes that were added
  std::vector<long> grid_labels;
  std::map<long, std::vector<int>> permanent;  // supports of GRID
  long default_system = 0, default_output = 0;
  std::vector<int> default_permanent;
  std::map<long, System> systems;
  std::vector<SolidLine> solids;
  std::vector<BeamLine> beams;
  std::vector<long> element_nodes;
  std::map<long, SolidPropertyLine> solid_properties;
  std::map<long, BeamPropertyLine> beam_properties;
  std::map<long, MaterialLine> materials;
  std::map<long, std::vector<SupportLine>> supports;            // by set
  std::map<long, std::vector<MpcLine>> mpcs;                    // by set
  std::map<long, std::vector<IdRange>> support_sums, mpc_sums;  // SPCADD, MPCADD: sets
  std::vector<RigidLine> rigids, averages;                      // RBE2, RBE3
  std::vector<MassLine> masses;
  std::set<long> mass_ids;
  std::map<long, std::optional<int>> methods;  // EIGRL, EIGR: number of modes
  double mass_factor = 1;                      // PARAM,WTMASS
};

// Readers of cards, one each; the table in read_nastran.cpp names them.
using Read = void (*)(Bulk&, const Card&);
void read_grid(Bulk&, const Card&);
void read_grdset(Bulk&, const Card&);
void read_system(Bulk&, const Card&);
void read_solid(Bulk&, const Card&);
void read_beam(Bulk&, const Card&);
void read_psolid(Bulk&, const Card&);
void read_pbar(Bulk&, const Card&);
void read_pbarl(Bulk&, const Card&);
void read_pbeam(Bulk&, const Card&);
void read_mat1(Bulk&, const Card&);
void read_other_material(Bulk&, const Card&);
void read_conm2(Bulk&, const Card&);
void read_rbe2(Bulk&, const Card&);
void read_rbe3(Bulk&, const Card&);
void read_rbar(Bulk&, const Card&);
void read_spc(Bulk&, const Card&);
void read_spc1(Bulk&, const Card&);
void read_sum(Bulk&, const Card&);
void read_mpc(Bulk&, const Card&);
void read_eigrl(Bulk&, const Card&);
void read_eigr(Bulk&, const Card&);
void read_param(Bulk&, const Card&);

/// Ids from field `first` on, with "a THRU b", up to a real number (thermal expansion of RBE2) or the end.
std::vector<IdRange> id_list(Bulk&, const Card&, size_t first);

/// Index of a node. @throws InputError at `at` if it is missing.
int node_of(const Bulk&, long id, std::string_view at);

/// Mesh of bulk data that have been read.
MeshFile mesh_of(Bulk&);

/// Adds supports, connections and masses of bulk data whose nodes and elements are in the mesh.
void add_connections(Bulk&, Mesh&);

}  // namespace flexboom::nastran
