#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace flexboom {

class Hdf5Writer;

/// An HDF5 file of tables, in memory. Its name for shapes is another one than that of meshes: none of both are here.
class TableFile {
 public:
  TableFile();
  ~TableFile();
  TableFile(const TableFile&) = delete;
  TableFile& operator=(const TableFile&) = delete;

  void note(const std::string& name, const std::string& value);  // an attribute of the file
  void add(const std::string& name, const std::string& what, const std::vector<std::int32_t>& values);
  void add(const std::string& name, const std::string& what, const std::vector<std::string>& values);
  void add(const std::string& name, const std::string& what, const std::vector<double>& values);
  /// Row by row.
  void add_rows(const std::string& name, const std::string& what, const std::vector<double>& values, size_t columns);

  std::string bytes() const;

 private:
  std::unique_ptr<Hdf5Writer> writer_;
};

}  // namespace flexboom
