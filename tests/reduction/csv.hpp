#pragma once

#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace flexboom::test {

/// A reference table: column name -> values. Lines that start with # are skipped.
using Table = std::map<std::string, std::vector<double>>;

inline Table read_csv(const std::string& file) {
  std::ifstream in(std::string(FLEXBOOM_TEST_DATA) + "/reference/" + file);
  if (!in) throw std::runtime_error("reference file not found: " + file);
  std::vector<std::string> names;
  Table table;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream cells(line);
    std::string cell;
    const bool header = names.empty();
    for (size_t i = 0; std::getline(cells, cell, ','); ++i) {
      if (header) {
        names.push_back(cell);
      } else {
        table[names.at(i)].push_back(std::stod(cell));
      }
    }
  }
  return table;
}

}  // namespace flexboom::test
