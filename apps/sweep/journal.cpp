// The door to SQLite.

#include "apps/sweep/journal.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "reduction/body_file/sha256.hpp"

#include <fmt/format.h>
#include <sqlite3.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace flexboom {

using nlohmann::ordered_json;

namespace {

constexpr const char* journal_format = "flexboom-sweep-2";

/// Name, value: what must be the same for two parts of one sweep.
ordered_json facts_of(const SweepIdentity& id) {
  const SweepDesign& d = id.design;
  return {{"format", journal_format},
          {"version", id.version},
          {"scene", id.scene},
          {"scene_sha256", id.scene_sha256},
          {"vary", d.vary},
          {"n", d.n ? ordered_json(*d.n) : ordered_json(nullptr)},
          {"sample", d.sample},
          {"seed", d.seed},
          {"indices", d.indices},
          {"loads", id.loads},
          {"trajectories", id.trajectories},
          {"quantities", id.quantities}};
}

SweepIdentity identity_of(const ordered_json& facts) {
  SweepIdentity id;
  facts.at("version").get_to(id.version), facts.at("scene").get_to(id.scene);
  facts.at("scene_sha256").get_to(id.scene_sha256);
  facts.at("vary").get_to(id.design.vary), facts.at("sample").get_to(id.design.sample);
  if (!facts.at("n").is_null()) id.design.n = facts.at("n").get<size_t>();
  facts.at("seed").get_to(id.design.seed), facts.at("indices").get_to(id.design.indices);
  facts.at("loads").get_to(id.loads), facts.at("trajectories").get_to(id.trajectories);
  facts.at("quantities").get_to(id.quantities);
  return id;
}

/// SHA-256 of what is stored of a run, `count` quantities: SQLite knows neither NaN nor the sign of zero.
std::string digest_of(const RunOutcome& o, size_t count) {
  const auto text_of = [](double v) { return std::isnan(v) ? std::string("none") : fmt::format("{:.17g}", v + 0.0); };
  std::string text = fmt::format("{}\n{}\n{}", o.run, run_status_names[static_cast<size_t>(o.status)], o.message);
  text += '\n' + text_of(o.seconds);
  for (size_t i = 0; i < count; ++i) text += '\n' + (i < o.quantities.size() ? text_of(o.quantities[i]) : "none");
  return sha256(text);
}

std::string digest_of(size_t run, std::string_view names, size_t rows, std::string_view bytes) {
  return sha256(fmt::format("{}\n{}\n{}\n", run, names, rows).append(bytes));
}

}  // namespace

/// A prepared statement, its parameters from 1 and its columns from 0.
class Journal::Statement {
 public:
  Statement(const Journal& journal, const std::string& sql) : journal_(journal) {
    check(sqlite3_prepare_v2(journal.database_.get(), sql.c_str(), -1, &statement_, nullptr));
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(int i, size_t v) { return check(sqlite3_bind_int64(statement_, i, static_cast<sqlite3_int64>(v))); }
  /// What is not a number is NULL.
  Statement& bind(int i, double v) {
    return check(std::isnan(v) ? sqlite3_bind_null(statement_, i) : sqlite3_bind_double(statement_, i, v));
  }
  Statement& bind(int i, std::string_view v) {
    return check(sqlite3_bind_text64(statement_, i, v.data(), v.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  }
  Statement& bind_bytes(int i, const void* bytes, size_t size) {
    return check(sqlite3_bind_blob64(statement_, i, bytes, size, SQLITE_TRANSIENT));
  }

  /// Is there a row?
  bool step() {
    const int code = sqlite3_step(statement_);
    if (code != SQLITE_ROW && code != SQLITE_DONE) check(code);
    return code == SQLITE_ROW;
  }

  size_t whole(int column) const { return static_cast<size_t>(sqlite3_column_int64(statement_, column)); }
  double number(int column) const {
    if (sqlite3_column_type(statement_, column) == SQLITE_NULL) return std::numeric_limits<double>::quiet_NaN();
    return sqlite3_column_double(statement_, column);
  }
  std::string text(int column) const {
    const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    return {bytes == nullptr ? "" : bytes, static_cast<size_t>(sqlite3_column_bytes(statement_, column))};
  }
  std::string bytes(int column) const {
    const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    return {bytes == nullptr ? "" : bytes, static_cast<size_t>(sqlite3_column_bytes(statement_, column))};
  }

 private:
  Statement& check(int code) {
    if (code == SQLITE_OK) return *this;
    throw InputError(fmt::format("{}: {}", journal_.file_.string(), sqlite3_errmsg(journal_.database_.get())));
  }

  const Journal& journal_;
  sqlite3_stmt* statement_ = nullptr;
};

void Journal::Close::operator()(sqlite3* database) const { sqlite3_close(database); }

namespace {

sqlite3* opened_database(const std::filesystem::path& file, int flags) {
  std::error_code none;
  if (std::filesystem::exists(file, none)) require_regular_file(file, std::numeric_limits<size_t>::max());
  sqlite3* database = nullptr;
  const int code = sqlite3_open_v2(file.c_str(), &database, flags, nullptr);
  if (code != SQLITE_OK) {
    sqlite3_close(database);
    throw InputError(fmt::format("{}: {}", file.string(), sqlite3_errstr(code)));
  }
  constexpr int patience = 10'000;  // with a reader [ms]
  sqlite3_busy_timeout(database, patience);
  return database;
}

}  // namespace

std::string SweepIdentity::digest() const { return sha256(facts_of(*this).dump()); }

Journal::Journal(const std::filesystem::path& file, const SweepIdentity& identity, bool resume)
    : file_(file), identity_(identity), database_(opened_database(file, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE)) {
  run_sql("PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL");
  if (!has_identity()) {  // new, or of a process that was killed before it wrote one
    write_identity();
    return;
  }
  require(resume, fmt::format("{} is the journal of a sweep: --resume goes on with it; or give another folder by --out",
                              file.string()));
  read_identity();
  const ordered_json is = facts_of(identity_), asked = facts_of(identity);
  for (const auto& [name, value] : asked.items())
    require(is.at(name) == value, fmt::format("--resume: {} is of another sweep: its {} is {}, not {}", file.string(),
                                              name, is.at(name).dump(), value.dump()));
  require(identity_.shard == identity.shard,
          fmt::format("--resume: {} is of shard {}/{}, not {}/{}", file.string(), identity_.shard.part,
                      identity_.shard.of, identity.shard.part, identity.shard.of));
  outcomes();  // a row that was changed is found before others are simulated
}

Journal::Journal(const std::filesystem::path& file) : file_(file) {
  require(std::filesystem::is_regular_file(file),
          fmt::format("{}: there is no such file; a folder of `flexboom sweep` has one", file.string()));
  database_.reset(opened_database(file, SQLITE_OPEN_READWRITE));
  require(has_identity(), fmt::format("{}: is no journal of `flexboom sweep`", file.string()));
  read_identity();
}

void Journal::run_sql(const std::string& sql) const {
  const int code = sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  require(code == SQLITE_OK, fmt::format("{}: {}", file_.string(), sqlite3_errmsg(database_.get())));
}

bool Journal::has_identity() const {
  return Statement(*this, "SELECT 1 FROM sqlite_master WHERE name = 'sweep'").step();
}

void Journal::write_identity() {
  std::string columns;  // quantities by number: names that differ in case alone are one to SQLite
  for (size_t i = 0; i < identity_.quantities.size(); ++i) columns += fmt::format(", q{} REAL", i + 1);
  add_all([&] {
    run_sql("CREATE TABLE sweep (sha256 TEXT, facts TEXT, shard INTEGER, shards INTEGER)");
    run_sql("CREATE TABLE quantities (number INTEGER PRIMARY KEY, name TEXT)");
    run_sql(fmt::format(
        "CREATE TABLE runs (run INTEGER PRIMARY KEY, sha256 TEXT, status TEXT, message TEXT, seconds REAL{})",
        columns));
    run_sql(
        "CREATE TABLE trajectories (run INTEGER PRIMARY KEY, sha256 TEXT, names TEXT, rows INTEGER, by_columns BLOB)");
    for (size_t i = 0; i < identity_.quantities.size(); ++i)
      Statement(*this, "INSERT INTO quantities VALUES (?, ?)").bind(1, i + 1).bind(2, identity_.quantities[i]).step();
    Statement(*this, "INSERT INTO sweep VALUES (?, ?, ?, ?)")
        .bind(1, identity_.digest())
        .bind(2, facts_of(identity_).dump())
        .bind(3, identity_.shard.part)
        .bind(4, identity_.shard.of)
        .step();
  });
}

void Journal::read_identity() {
  try {
    Statement row(*this, "SELECT sha256, facts, shard, shards FROM sweep");
    require(row.step(), fmt::format("{}: its table `sweep` is empty", file_.string()));
    const ordered_json facts = ordered_json::parse(row.text(1));
    require(facts.at("format") == journal_format,
            fmt::format("{}: its format is {}; this version reads \"{}\"", file_.string(), facts.at("format").dump(),
                        journal_format));
    identity_ = identity_of(facts);
    identity_.shard = {row.whole(2), row.whole(3)};
    require(row.text(0) == identity_.digest(),
            fmt::format("{}: what it says of its sweep was changed: the checksum differs", file_.string()));
  } catch (const ordered_json::exception& error) {
    throw InputError(fmt::format("{}: is no journal of `flexboom sweep`: {}", file_.string(), error.what()));
  }
}

void Journal::add_all(const std::function<void()>& adding) {
  run_sql("BEGIN IMMEDIATE");
  try {
    adding();
  } catch (...) {
    sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
    throw;
  }
  run_sql("COMMIT");
}

void Journal::add(const RunOutcome& outcome) {
  const auto insert = [&] {
    const size_t count = identity_.quantities.size();
    std::string places = "?, ?, ?, ?, ?";
    for (size_t i = 0; i < count; ++i) places += ", ?";
    Statement row(*this, fmt::format("INSERT INTO runs VALUES ({})", places));
    row.bind(1, outcome.run).bind(2, digest_of(outcome, count));
    row.bind(3, run_status_names[static_cast<size_t>(outcome.status)]);
    row.bind(4, outcome.message).bind(5, outcome.seconds);
    for (size_t i = 0; i < std::min(count, outcome.quantities.size()); ++i)  // what is not bound is NULL
      row.bind(static_cast<int>(i) + 6, outcome.quantities[i]);
    row.step();
    if (!outcome.trajectory) return;
    const OutputTable& t = *outcome.trajectory;
    const std::string names = ordered_json(t.names).dump();
    const auto rows = static_cast<size_t>(t.values.rows());
    const std::string_view bytes(reinterpret_cast<const char*>(t.values.data()),
                                 static_cast<size_t>(t.values.size()) * sizeof(double));
    Statement(*this, "INSERT INTO trajectories VALUES (?, ?, ?, ?, ?)")
        .bind(1, outcome.run)
        .bind(2, digest_of(outcome.run, names, rows, bytes))
        .bind(3, names)
        .bind(4, rows)
        .bind_bytes(5, bytes.data(), bytes.size())
        .step();
  };
  // A statement by itself is a transaction by itself.
  const bool alone = !outcome.trajectory || sqlite3_get_autocommit(database_.get()) == 0;
  alone ? insert() : add_all(insert);
}

std::vector<size_t> Journal::runs() const {
  std::vector<size_t> runs;
  Statement rows(*this, "SELECT run FROM runs ORDER BY run");
  while (rows.step()) runs.push_back(rows.whole(0));
  return runs;
}

std::vector<RunOutcome> Journal::outcomes() const {
  std::map<std::string, RunStatus> status;
  for (size_t i = 0; i < run_status_names.size(); ++i)
    status[std::string(run_status_names[i])] = static_cast<RunStatus>(i);
  std::vector<RunOutcome> outcomes;
  Statement rows(*this, "SELECT * FROM runs ORDER BY run");
  while (rows.step()) {
    RunOutcome& o = outcomes.emplace_back();
    o.run = rows.whole(0);
    const auto found = status.find(rows.text(2));
    require(found != status.end(), fmt::format("{}: run {} has status '{}'", file_.string(), o.run, rows.text(2)));
    o.status = found->second;
    o.message = rows.text(3), o.seconds = rows.number(4);
    for (size_t i = 0; i < identity_.quantities.size(); ++i)
      o.quantities.push_back(rows.number(static_cast<int>(i) + 5));
    require(rows.text(1) == digest_of(o, o.quantities.size()),
            fmt::format("{}: what it says of run {} was changed: the checksum differs", file_.string(), o.run));
  }
  return outcomes;
}

std::optional<OutputTable> Journal::trajectory(size_t run) const {
  Statement row(*this, "SELECT sha256, names, rows, by_columns FROM trajectories WHERE run = ?");
  if (!row.bind(1, run).step()) return {};
  const std::string names = row.text(1), bytes = row.bytes(3);
  require(row.text(0) == digest_of(run, names, row.whole(2), bytes),
          fmt::format("{}: the trajectory of run {} was changed: the checksum differs", file_.string(), run));
  OutputTable table;
  table.names = ordered_json::parse(names).get<std::vector<std::string>>();
  const auto rows = static_cast<Eigen::Index>(row.whole(2)), columns = std::ssize(table.names);
  table.values = Eigen::Map<const Eigen::MatrixXd>(reinterpret_cast<const double*>(bytes.data()), rows, columns);
  return table;
}

}  // namespace flexboom
