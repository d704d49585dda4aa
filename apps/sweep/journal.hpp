#pragma once

#include "apps/sweep/runner.hpp"
#include "apps/sweep/variation.hpp"

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

struct sqlite3;  // of SQLite

namespace flexboom {

/// Part of the runs of a sweep: those whose number modulo `of` is `part` - 1.
struct Shard {
  size_t part = 1, of = 1;
  bool operator==(const Shard&) const = default;
};

/// What a sweep is. Its runs follow from that alone.
struct SweepIdentity {
  std::string version;       // of flexboom
  std::string scene;         // its name
  std::string scene_sha256;  // of its files
  SweepDesign design;
  bool loads = false, trajectories = false;
  std::vector<std::string> quantities;
  Shard shard;

  /// SHA-256 of all of it but the shard.
  std::string digest() const;
};

/// The outcomes of the runs so far, in an SQLite file. Each one is a transaction: a process that is killed at any
/// instant leaves those before it. One process at a time writes.
class Journal {
 public:
  /// Makes a journal, or with `resume` takes up one of the same sweep. @throws InputError for a journal that is there
  /// already, or is of another sweep: it names what differs.
  Journal(const std::filesystem::path& file, const SweepIdentity&, bool resume);

  /// As it is. @throws InputError for a file that is no journal.
  explicit Journal(const std::filesystem::path& file);

  const SweepIdentity& identity() const { return identity_; }
  void add(const RunOutcome&);

  /// Several in one transaction.
  void add_all(const std::function<void()>& adding);

  /// Numbers of the runs that it has, ascending.
  std::vector<size_t> runs() const;

  /// Without trajectories, ascending by run.
  std::vector<RunOutcome> outcomes() const;
  std::optional<OutputTable> trajectory(size_t run) const;

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  class Statement;
  void run_sql(const std::string& sql) const;
  bool has_identity() const;
  void write_identity();
  void read_identity();

  std::filesystem::path file_;
  SweepIdentity identity_;
  std::unique_ptr<sqlite3, Close> database_;
};

}  // namespace flexboom
