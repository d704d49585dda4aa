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

class Saver {
 public:
  explicit Saver(Hdf5Writer& file) : file_(file) {}

  static std::uint64_t size(const std::string& name, std::uint64_t current, const Shape& allowed) {
    check_count(name, current, allowed);
    return current;
  }

  template <class List>
  static void resize(const std::string& name, const List& list, std::uint64_t count) {
    check_count(name, list.size(), {count});
  }

  void attribute(const std::string& name, const std::string& text) { file_.write_attribute(name, text); }

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
    file_.write(field, joined(lead, each), values);
  }

  template <class T>
  void values(const Field& field, const Shape& shape, const std::vector<T*>& entries) {
    using Value = typename Stored<std::remove_const_t<T>>::type;
    std::vector<Value> values;
    values.reserve(entries.size());
    for (const T* entry : entries) values.push_back(static_cast<Value>(*entry));
    check_finite(field, values);
    file_.write(field, shape, values);
  }

 private:
  Hdf5Writer& file_;
};

class Loader {
 public:
  explicit Loader(Hdf5Reader& file) : file_(file) {}

  std::uint64_t size(const std::string& name, std::uint64_t /*current*/, const Shape& allowed) const {
    const Shape shape = file_.shape(name);
    require(!shape.empty(), fmt::format(R"(dataset "{}" is a single value, must be a list)", name));
    check_count("dataset \"" + name + "\"", shape[0], allowed);
    return shape[0];
  }

  template <class List>
  static void resize(const std::string& /*name*/, List& list, std::uint64_t count) {
    list.resize(count);
  }

  void attribute(const std::string& name, std::string& text) { text = file_.text_attribute(name); }

  template <class Matrix>
  void matrices(const Field& field, const Shape& lead, const Shape& each, const std::vector<Matrix*>& blocks) {
    const std::vector<double> values = file_.read<double>(field, joined(lead, each));
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
    const auto values = file_.read<typename Stored<T>::type>(field, shape);
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

ReducedBody body_of(const std::string& bytes) {
  check_seal(bytes);
  Hdf5Reader file(bytes);
  require(file.text_attribute("format") == format_name,
          fmt::format(R"(the attribute "format" must be "{}")", format_name));
  const int version = file.integer_attribute("version");
  require(version == body_file_version, fmt::format("the attribute \"version\" must be {}", body_file_version));
  ReducedBody body;
  Loader loader(file);
  body_file::fields(loader, body);
  const std::string content = file.content().digest();
  require(file.text_attribute("checksum") == content,
          "checksum of the content does not match: the file was changed after it was written");
  check_display(body.display);
  body.validate();
  return body;
}

}  // namespace

void write_body_file(const std::filesystem::path& path, const ReducedBody& body) {
  std::string bytes;
  within("cannot write " + path.string(), [&] {
    body.validate();
    check_display(body.display);
    Hdf5Writer file(seal_size);
    file.write_attribute("format", std::string(format_name));
    file.write_attribute("version", body_file_version);
    Saver saver(file);
    body_file::fields(saver, body);
    file.write_attribute("checksum", file.content().digest());
    bytes = file.bytes();
    seal(bytes);
  });
  write_file(path, bytes);
}

ReducedBody read_body_file(const std::filesystem::path& path) {
  const std::string bytes = file_bytes(path);
  ReducedBody body;
  within(path.string(), [&] { body = body_of(bytes); });
  return body;
}

}  // namespace flexboom
