#include "fem/base/label_index.hpp"
#include "fem/formats/gmsh/data.hpp"
#include "fem/formats/gmsh/gmsh.hpp"
#include "fem/formats/gmsh/source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <utility>

namespace flexboom {
namespace {

constexpr std::array<std::string_view, 8> without_effect = {
    "Periodic",    "Parametrizations", "GhostElements",   "NodeData",
    "ElementData", "Comments",         "ElementNodeData", "InterpolationScheme",
};

/// Reads the sections in the order of the file.
class GmshParser {
 public:
  GmshParser(std::string_view text, const std::string& file) : source_(text, file) {}

  GmshData parse();

 private:
  void section(std::string_view mark);
  void skip_section(std::string_view mark, std::string_view name);
  void end_section(std::string_view name);
  void format();
  void byte_order();
  void begin_numbers();
  void names();
  void entities(bool partitioned);
  void entity(int dimension, bool partitioned);
  void nodes_2();
  void nodes_4();
  void node_block_4();
  void number_nodes();
  void check_labels();
  void elements_2();
  void text_elements_2(size_t count);
  void binary_elements_2(size_t count);
  void element_2(int type, long label, int tag_count);
  void elements_4();
  void element_block_4();
  const GmshKind& kind(int type);
  GmshData::Block& block(const GmshKind&, int entity, const std::vector<int>& physical);
  void element(GmshData::Block&, long label, bool wide);
  void coordinates();

  GmshSource source_;
  GmshData data_;
  LabelIndex nodes_{{}};
  bool has_nodes_ = false, has_elements_ = false;
  bool version_4_ = false;
  std::map<std::pair<int, int>, std::vector<int>> physical_;  // of (dimension, entity)
  const GmshKind* last_kind_ = nullptr;
};

GmshData GmshParser::parse() {
  TextReader& text = source_.text();
  const std::string_view first = text.next_token();
  if (first == "$NOD") text.fail(first, "is Gmsh's version 1; save as version 4.1 or 2.2 (gmsh -save -format msh41)");
  if (first != "$MeshFormat")
    text.fail(first, fmt::format("a .msh file begins with $MeshFormat, this one with {}", quoted(first)));
  format();
  end_section("MeshFormat");
  for (;;) {
    const std::string_view mark = text.next_token();
    if (mark.empty()) break;
    section(mark);
  }
  const std::string_view end = text.text().substr(text.text().size());
  if (!has_nodes_) text.fail(end, "the file ends without $Nodes");
  if (!has_elements_) text.fail(end, "the file ends without $Elements");
  return std::move(data_);
}

void GmshParser::section(std::string_view mark) {
  TextReader& text = source_.text();
  if (mark.front() != '$' || mark.size() < 2)
    text.fail(mark, fmt::format("a section such as $Nodes should begin here, not {}", quoted(mark)));
  const std::string_view name = mark.substr(1);
  if (name == "PhysicalNames") {
    names();
  } else if (version_4_ && (name == "Entities" || name == "PartitionedEntities")) {
    entities(name == "PartitionedEntities");
  } else if (name == "Nodes") {
    if (has_nodes_) text.fail(mark, "a second $Nodes");
    version_4_ ? nodes_4() : nodes_2();
    number_nodes();
  } else if (name == "Elements") {
    if (!has_nodes_) text.fail(mark, "$Elements must come after $Nodes");
    if (has_elements_) text.fail(mark, "a second $Elements");
    has_elements_ = true;
    version_4_ ? elements_4() : elements_2();
    check_labels();
  } else {
    return skip_section(mark, name);
  }
  end_section(name);
}

void GmshParser::skip_section(std::string_view mark, std::string_view name) {
  TextReader& text = source_.text();
  const size_t end = text.text().find(fmt::format("$End{}", name), text.position());
  if (end == std::string_view::npos) text.fail(mark, fmt::format("${0} has no $End{0}", std::string(name)));
  text.seek(end);
  end_section(name);
  if (std::ranges::count(without_effect, name) == 0)
    data_.notes.push_back(fmt::format("{}: section {} is not read", text.location(mark), quoted(mark)));
}

void GmshParser::end_section(std::string_view name) {
  TextReader& text = source_.text();
  const std::string_view token = text.next_token();
  if (token.substr(0, 4) == "$End" && token.substr(4) == name) return;
  const std::string wrong = token.empty() ? "the file ends" : "is " + quoted(token);
  text.fail(token, fmt::format("{} where $End{} should be: a count is wrong or the file was cut", wrong, name));
}

void GmshParser::format() {
  TextReader& text = source_.text();
  const std::string_view version = text.next_token();
  version_4_ = version == "4.1";
  if (!version_4_ && version.substr(0, 2) != "2.")
    text.fail(version,
              fmt::format("version {} is not read; save as 4.1 or 2.2 (gmsh -save -format msh41)", quoted(version)));
  const bool binary = text.integer("the file type", 0, 1) == 1;
  const std::string_view size = text.next_token();
  if (size != "8") text.fail(size, fmt::format("the size of numbers is {}; it must be 8", quoted(size)));
  if (binary) byte_order();
}

// The integer 1 in the byte order of the file, after the line of the version.
void GmshParser::byte_order() {
  TextReader& text = source_.text();
  const size_t line_end = text.text().find('\n', text.position());
  const std::string_view bytes = line_end == std::string_view::npos ? "" : text.text().substr(line_end + 1, 4);
  const bool same = bytes == std::string_view("\x01\0\0\0", 4), swapped = bytes == std::string_view("\0\0\0\x01", 4);
  source_.set_binary(swapped);
  text.seek(std::min(line_end, text.text().size()));
  if (!same && !swapped) {
    text.fail(text.text().substr(text.position()),
              "after this line should be the integer 1 in four bytes, which tells the byte order");
  }
  text.seek(line_end + 5);
}

// Binary numbers begin right after the end of a line.
void GmshParser::begin_numbers() {
  if (source_.is_binary()) source_.text().seek(source_.text().position() + 1);
}

void GmshParser::names() {
  TextReader& text = source_.text();
  const long count = text.integer("the number of physical names");
  for (long i = 0; i < count; ++i) {
    GmshData::Group group;
    group.dimension = static_cast<int>(text.integer("the dimension of a physical group", 0, 3));
    group.tag = static_cast<int>(text.integer("the tag of a physical group", 1, std::numeric_limits<int>::max()));
    const std::string_view rest = trimmed(text.next_line().value_or(""));
    if (rest.size() < 2 || rest.front() != '"' || rest.back() != '"')
      text.fail(rest, fmt::format("the name of a physical group must be in double quotes, not {}", quoted(rest)));
    group.name = rest.substr(1, rest.size() - 2);
    data_.names.push_back(std::move(group));
  }
}

void GmshParser::entities(bool partitioned) {
  begin_numbers();
  if (partitioned) {
    source_.size("the number of partitions");
    source_.skip_integers(2 * source_.count("the number of ghost entities", 2));
  }
  std::array<size_t, 4> counts{};
  for (size_t& count : counts) count = source_.count("the number of entities", 5);
  for (int dimension = 0; dimension < 4; ++dimension) {
    for (size_t i = 0; i < counts[static_cast<size_t>(dimension)]; ++i) entity(dimension, partitioned);
  }
}

void GmshParser::entity(int dimension, bool partitioned) {
  const int tag = source_.integer("the tag of an entity");
  if (partitioned) {
    source_.skip_integers(2);  // parent
    source_.skip_integers(source_.count("the number of partitions of an entity", 1));
  }
  source_.skip_reals(dimension == 0 ? 3 : 6);
  const size_t count = source_.count("the number of physical groups of an entity", 1);
  std::vector<int> tags;
  for (size_t i = 0; i < count; ++i) tags.push_back(source_.integer("the tag of a physical group"));
  if (dimension > 0) source_.skip_integers(source_.count("the number of bounding entities", 1));
  for (int& group : tags) group = std::max(group, -group);  // the sign is an orientation
  std::erase(tags, 0);
  physical_[{dimension, tag}] = std::move(tags);
}

void GmshParser::coordinates() {
  for (int i = 0; i < 3; ++i) data_.coordinates.push_back(source_.real("a coordinate"));
}

void GmshParser::nodes_2() {
  const long listed = source_.text().integer("the number of nodes");
  begin_numbers();
  const size_t count = source_.check_count("the number of nodes", listed, 4);
  data_.node_labels.reserve(count);
  data_.coordinates.reserve(3 * count);
  for (size_t i = 0; i < count; ++i) {
    data_.node_labels.push_back(source_.integer("the number of a node"));
    coordinates();
  }
}

void GmshParser::nodes_4() {
  begin_numbers();
  const size_t blocks = source_.count("the number of node blocks", 4);
  const size_t count = source_.count("the number of nodes", 4);
  source_.size("the lowest node");
  source_.size("the highest node");
  data_.node_labels.reserve(count);
  data_.coordinates.reserve(3 * count);
  for (size_t i = 0; i < blocks; ++i) node_block_4();
  if (data_.node_labels.size() != count)
    source_.fail(fmt::format("$Nodes announces {} nodes and holds {}", count, data_.node_labels.size()));
}

void GmshParser::node_block_4() {
  const int dimension = source_.integer("the dimension of an entity");
  source_.integer("the tag of an entity");
  const bool parametric = source_.integer("whether a block has parameters") != 0;
  const size_t count = source_.count("the number of nodes of a block", 4);
  if (dimension < 0 || dimension > 3)
    source_.fail(fmt::format("dimension {} of an entity; it must be 0 to 3", dimension));
  for (size_t i = 0; i < count; ++i) data_.node_labels.push_back(source_.size("the number of a node"));
  for (size_t i = 0; i < count; ++i) {
    coordinates();
    if (parametric) source_.skip_reals(static_cast<size_t>(dimension));
  }
}

void GmshParser::number_nodes() {
  has_nodes_ = true;
  if (data_.node_labels.size() > static_cast<size_t>(std::numeric_limits<int>::max() / 3))
    source_.fail("there are more nodes than can be numbered");
  nodes_ = LabelIndex(data_.node_labels);
  if (nodes_.duplicate()) source_.fail(fmt::format("node {} is defined twice in this $Nodes", *nodes_.duplicate()));
}

void GmshParser::check_labels() {
  std::vector<long> labels;
  for (const GmshData::Block& block : data_.blocks)
    labels.insert(labels.end(), block.labels.begin(), block.labels.end());
  const std::optional<long> twice = LabelIndex(labels).duplicate();
  if (twice) source_.fail(fmt::format("element {} is defined twice in this $Elements", *twice));
}

const GmshKind& GmshParser::kind(int type) {
  if (last_kind_ == nullptr || last_kind_->type != type) last_kind_ = gmsh_kind(type);
  if (last_kind_ == nullptr) {
    source_.fail(
        fmt::format("element type {} is {}; there are tetrahedra (4, 11), hexahedra (5, 12, 17, 92 to 97) and "
                    "prisms (6, 18)",
                    type, gmsh_kind_name(type)));
  }
  return *last_kind_;
}

GmshData::Block& GmshParser::block(const GmshKind& kind, int entity, const std::vector<int>& physical) {
  if (!data_.blocks.empty()) {
    GmshData::Block& last = data_.blocks.back();
    if (last.kind == &kind && last.entity == entity && last.physical == physical) return last;
  }
  return data_.blocks.emplace_back(GmshData::Block{&kind, entity, physical, {}, {}});
}

void GmshParser::element(GmshData::Block& block, long label, bool wide) {
  block.labels.push_back(label);
  for (int i = 0; i < block.kind->nodes; ++i) {
    const long node = wide ? source_.size("a node of an element") : source_.integer("a node of an element");
    const int index = nodes_.find(node);
    if (index < 0) source_.fail(fmt::format("element {}: node {} is not in $Nodes", label, node));
    block.nodes.push_back(index);
  }
}

void GmshParser::elements_2() {
  const long listed = source_.text().integer("the number of elements");
  begin_numbers();
  const size_t count = source_.check_count("the number of elements", listed, source_.is_binary() ? 2 : 4);
  source_.is_binary() ? binary_elements_2(count) : text_elements_2(count);
}

void GmshParser::text_elements_2(size_t count) {
  for (size_t i = 0; i < count; ++i) {
    const int label = source_.integer("the number of an element");
    const int type = source_.integer("the type of an element");
    kind(type);
    element_2(type, label, source_.integer("the number of tags of an element"));
  }
}

void GmshParser::binary_elements_2(size_t count) {
  for (size_t i = 0; i < count;) {
    const int type = source_.integer("the type of elements");
    kind(type);
    const size_t in_block = source_.check_count("the number of elements of a block", source_.integer("a count"), 2);
    const int tags = source_.integer("the number of tags of elements");
    if (in_block == 0 || in_block > count - i)
      source_.fail(fmt::format("a block of {} elements where {} of {} are left", in_block, count - i, count));
    for (size_t k = 0; k < in_block; ++k) element_2(type, source_.integer("the number of an element"), tags);
    i += in_block;
  }
}

// Tags: physical group (0: none), entity, then partitions.
void GmshParser::element_2(int type, long label, int tag_count) {
  const size_t tags = source_.check_count("the number of tags of an element", tag_count, 1);
  const int physical = tags > 0 ? source_.integer("the physical group of an element") : 0;
  const int entity = tags > 1 ? source_.integer("the entity of an element") : 0;
  if (tags > 2) source_.skip_integers(tags - 2);
  const std::vector<int> groups(physical != 0 ? 1 : 0, std::max(physical, -physical));
  element(block(kind(type), entity, groups), label, false);
}

void GmshParser::elements_4() {
  begin_numbers();
  const size_t blocks = source_.count("the number of element blocks", 4);
  const size_t count = source_.count("the number of elements", 2);
  source_.size("the lowest element");
  source_.size("the highest element");
  for (size_t i = 0; i < blocks; ++i) element_block_4();
  size_t total = 0;
  for (const GmshData::Block& block : data_.blocks) total += block.labels.size();
  if (total != count) source_.fail(fmt::format("$Elements announces {} elements and holds {}", count, total));
}

void GmshParser::element_block_4() {
  source_.integer("the dimension of an entity");
  const int entity = source_.integer("the tag of an entity");
  const GmshKind& type = kind(source_.integer("the type of elements"));
  const auto nodes = static_cast<size_t>(type.nodes);
  const size_t count = source_.count("the number of elements of a block", 1 + nodes);
  const auto groups = physical_.find({type.dimension, entity});
  GmshData::Block& target = block(type, entity, groups == physical_.end() ? std::vector<int>{} : groups->second);
  target.labels.reserve(target.labels.size() + count);
  target.nodes.reserve(target.nodes.size() + count * nodes);
  for (size_t i = 0; i < count; ++i) element(target, source_.size("the number of an element"), true);
}

}  // namespace

GmshData parse_gmsh(std::string_view text, const std::string& file) { return GmshParser(text, file).parse(); }

MeshFile read_gmsh(std::string_view text, const std::string& file) { return mesh_of(parse_gmsh(text, file), file); }

}  // namespace flexboom
