#include "reduction/body_file/body_file.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/mesh/validation.hpp"
#include "reduction/body_file/layout.hpp"
#include "reduction/body_file/seal.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace flexboom {
namespace {

constexpr const char* format_name = "flexboom-body";

/// How a value is kept in the file.
template <class T>
struct Stored {
  using type = T;
};
template <>
struct Stored<bool> {
  using type = std::uint8_t;
};
template <>
struct Stored<int> {
  using type = std::int32_t;
};

void check_count(const std::string& name, std::uint64_t count, const Shape& allowed) {
  require(allowed.empty() || std::find(allowed.begin(), allowed.end(), count) != allowed.end(),
          fmt::format("{} has {} entries, must have {}", name, count, fmt::join(allowed, " or ")));
}

template <class T>
void check_finite(const Field& field, const std::vector<T>& values) {
  if constexpr (std::is_same_v<T, double>) {
    require(!field.finite || std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); }),
            field.name + " has entries that are not finite");
  }
}

Shape joined(Shape lead, const Shape& each) {
  lead.insert(lead.end(), each.begin(), each.end());
  return lead;
}

Eigen::Index rows(const Shape& each) { return static_cast<Eigen::Index>(each[0]); }
Eigen::Index cols(const Shape& each) { return each.size() > 1 ? static_cast<Eigen::Index>(each[1]) : 1; }

/// The field in a group of the file: "more_modes/Me" for "Me".
Field in_group(const std::string& group, Field field) {
  field.name.insert(0, group);
  return field;
}

/// `group`: of the body in the file, empty or ending in a slash.
class Saver {
 public:
  Saver(Hdf5Writer& file, std::string group) : file_(file), group_(std::move(group)) {}

  static std::uint64_t size(const std::string& name, std::uint64_t current, const Shape& allowed) {
    check_count(name, current, allowed);
    return current;
  }

  template <class List>
  static void resize(const std::string& name, const List& list, std::uint64_t count) {
    check_count(name, list.size(), {count});
  }

  void attribute(const std::string& name, const std::string& text) { file_.write_attribute(group_ + name, text); }

  template <class Matrix>
  void matrices(const Field& field, const Shape& lead, const Shape& each, const std::vector<Matrix*>& blocks) {
    std::vector<double> values;
    values.reserve(blocks.size() * static_cast<size_t>(rows(each) * cols(each)));
    for (const Matrix* A : blocks) {
      require(A->rows() == rows(each) && A->cols() == cols(each),
              fmt::format("{} is {} x {}, must be {} x {}", field.name, A->rows(), A->cols(), rows(each), cols(each)));
      for (Eigen::Index i = 0; i < A->rows(); ++i) {
        for (Eigen::Index j = 0; j < A->cols(); ++j) values.push_back((*A)(i, j));
      }
    }
    check_finite(field, values);
    file_.write(in_group(group_, field), joined(lead, each), values);
  }

  template <class T>
  void values(const Field& field, const Shape& shape, const std::vector<T*>& entries) {
    using Value = typename Stored<std::remove_const_t<T>>::type;
    std::vector<Value> values;
    values.reserve(entries.size());
    for (const T* entry : entries) values.push_back(static_cast<Value>(*entry));
    check_finite(field, values);
    file_.write(in_group(group_, field), shape, values);
  }

 private:
  Hdf5Writer& file_;
  std::string group_;
};

class Loader {
 public:
  Loader(Hdf5Reader& file, std::string group) : file_(file), group_(std::move(group)) {}

  std::uint64_t size(const std::string& in_body, std::uint64_t /*current*/, const Shape& allowed) const {
    const std::string name = group_ + in_body;
    const Shape shape = file_.shape(name);
    require(!shape.empty(), fmt::format(R"(dataset "{}" is a single value, must be a list)", name));
    check_count("dataset \"" + name + "\"", shape[0], allowed);
    return shape[0];
  }

  template <class List>
  static void resize(const std::string& /*name*/, List& list, std::uint64_t count) {
    list.resize(count);
  }

  void attribute(const std::string& name, std::string& text) { text = file_.text_attribute(group_ + name); }

  template <class Matrix>
  void matrices(const Field& field, const Shape& lead, const Shape& each, const std::vector<Matrix*>& blocks) {
    const std::vector<double> values = file_.read<double>(in_group(group_, field), joined(lead, each));
    check_finite(field, values);
    auto value = values.begin();
    for (Matrix* A : blocks) {
      A->resize(rows(each), cols(each));
      for (Eigen::Index i = 0; i < A->rows(); ++i) {
        for (Eigen::Index j = 0; j < A->cols(); ++j) (*A)(i, j) = *value++;
      }
    }
  }

  template <class T>
  void values(const Field& field, const Shape& shape, const std::vector<T*>& entries) {
    const auto values = file_.read<typename Stored<T>::type>(in_group(group_, field), shape);
    check_finite(field, values);
    for (size_t i = 0; i < values.size(); ++i) {
      if constexpr (std::is_same_v<T, bool>) {
        require(values[i] <= 1, fmt::format("{} must be 0 or 1, is {}", field.name, values[i]));
        *entries[i] = values[i] == 1;
      } else {
        *entries[i] = values[i];
      }
    }
  }

 private:
  Hdf5Reader& file_;
  std::string group_;
};

/// Lines and triangles lie over the points.
void check_display(const DisplayShape& display) {
  const auto check = [&](int point, const char* name) {
    require(point >= 0 && point < display.points.cols(),
            fmt::format("{} has point {} of {}", name, point, display.points.cols()));
  };
  for (const std::vector<int>& line : display.lines) {
    for (const int point : line) check(point, "display/lines");
  }
  for (const std::array<int, 3>& triangle : display.triangles) {
    for (const int point : triangle) check(point, "display/triangles");
  }
}

// Groups of the richer bodies in a file.
constexpr const char* more_modes = "more_modes";
constexpr const char* finer_elements = "finer_elements";
const Field error_per_change = {"error_per_change", "1",
                                "error of the elements by what the finer ones change, at most"};

void save(Hdf5Writer& file, const std::string& group, const ReducedBody& body) {
  body.validate();
  check_display(body.display);
  Saver saver(file, group);
  body_file::fields(saver, body);
}

ReducedBody load(Hdf5Reader& file, const std::string& group) {
  ReducedBody body;
  Loader loader(file, group);
  body_file::fields(loader, body);
  return body;
}

BodyFile content_of(const std::string& bytes) {
  const int version = check_seal(bytes);
  Hdf5Reader file(bytes);
  require(file.text_attribute("format") == format_name,
          fmt::format(R"(the attribute "format" must be "{}")", format_name));
  require(file.integer_attribute("version") == version,
          fmt::format("the attribute \"version\" must be {}, as in the head of the file", version));
  BodyFile r{.body = load(file, "")};
  const auto richer = [&](const std::string& group) -> std::optional<ReducedBody> {
    if (version == version_without_richer_bodies || file.integer_attribute(group) == 0) return {};
    return load(file, group + "/");
  };
  r.richer = {richer(more_modes), richer(finer_elements)};
  if (r.richer.finer_elements) r.richer.error_per_change = file.read<double>(error_per_change, {}).front();
  const std::string content = file.content().digest();
  require(file.text_attribute("checksum") == content,
          "checksum of the content does not match: the file was changed after it was written");
  const auto check = [](const ReducedBody& body) { check_display(body.display), body.validate(); };
  check(r.body);
  for (const std::optional<ReducedBody>* body : {&r.richer.more_modes, &r.richer.finer_elements})
    if (*body) check(**body);
  return r;
}

}  // namespace

void write_body_file(const std::filesystem::path& path, const ReducedBody& body, const RicherBodies& richer) {
  std::string bytes;
  const int version = richer.empty() ? version_without_richer_bodies : body_file_version;
  within("cannot write " + path.string(), [&] {
    Hdf5Writer file(seal_size);
    file.write_attribute("format", std::string(format_name));
    file.write_attribute("version", version);
    save(file, "", body);
    const auto save_richer = [&](const std::string& group, const std::optional<ReducedBody>& other) {
      if (richer.empty()) return;
      file.write_attribute(group, other ? 1 : 0);
      if (other) save(file, group + "/", *other);
    };
    save_richer(more_modes, richer.more_modes), save_richer(finer_elements, richer.finer_elements);
    if (richer.finer_elements) file.write(error_per_change, {}, std::vector{richer.error_per_change});
    file.write_attribute("checksum", file.content().digest());
    bytes = file.bytes();
    seal(bytes, version);
  });
  write_file(path, bytes);
}

BodyFile read_whole_body_file(const std::filesystem::path& path) {
  const std::string bytes = file_bytes(path);
  BodyFile r;
  within(path.string(), [&] { r = content_of(bytes); });
  return r;
}

ReducedBody read_body_file(const std::filesystem::path& path) { return read_whole_body_file(path).body; }

}  // namespace flexboom
