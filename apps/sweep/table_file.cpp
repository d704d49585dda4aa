#include "apps/sweep/table_file.hpp"

#include "reduction/body_file/hdf5.hpp"

namespace flexboom {

TableFile::TableFile() : writer_(std::make_unique<Hdf5Writer>(0)) {}
TableFile::~TableFile() = default;

void TableFile::note(const std::string& name, const std::string& value) { writer_->write_attribute(name, value); }

void TableFile::add(const std::string& name, const std::string& what, const std::vector<std::int32_t>& values) {
  writer_->write({name, "1", what}, {values.size()}, values);
}

void TableFile::add(const std::string& name, const std::string& what, const std::vector<std::string>& values) {
  writer_->write({name, "", what}, {values.size()}, values);
}

void TableFile::add(const std::string& name, const std::string& what, const std::vector<double>& values) {
  writer_->write({name, "", what, false}, {values.size()}, values);
}

void TableFile::add_rows(const std::string& name, const std::string& what, const std::vector<double>& values,
                         size_t columns) {
  writer_->write({name, "", what, false}, {values.size() / columns, columns}, values);
}

std::string TableFile::bytes() const { return writer_->bytes(); }

}  // namespace flexboom
