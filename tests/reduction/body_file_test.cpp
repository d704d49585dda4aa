#include "reduction/body_file/body_file.hpp"

#include "fem/base/check.hpp"
#include "reduction/basis/modal_basis.hpp"
#include "reduction/body_file/sha256.hpp"
#include "reduction/invariants/eq14.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/booms.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <random>
#include <sstream>

namespace flexboom {
namespace {

namespace fs = std::filesystem;

/// A folder of its own that goes with the test.
struct Folder {
  fs::path path = fs::temp_directory_path() / ("flexboom_body_file_" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
};

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

void put_text(const fs::path& path, std::string_view text) {
  std::ofstream(path, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
}

/// Every bit of a body, with the sizes of everything. The bindings fail to compile when a field is added.
class Bits {
 public:
  explicit Bits(const ReducedBody& body) {
    const auto& [name, structure, frame, m, mc0, J0, Ct, Cr0, Cr1, Me, J1, J2, Ke, De, Kg, gram, coordinates,
                 interfaces, markers, display, provenance, certificate, full_freedoms] = body;
    all(name, structure, frame, m, mc0, J0, Ct, Cr0, Cr1, Me, J1, J2, Ke, De, Kg, gram, coordinates, interfaces,
        markers, display, provenance, certificate, full_freedoms);
  }
  std::string text;

 private:
  template <class... T>
  void all(const T&... values) {
    (add(values), ...);
  }
  template <class T>
  requires std::is_arithmetic_v<T>
  void add(T value) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    text.append(bytes, sizeof(T));
  }
  void add(const std::string& value) {
    add(value.size());
    text += value;
  }
  template <class Derived>
  void add(const Eigen::PlainObjectBase<Derived>& A) {
    all(A.rows(), A.cols());
    for (Eigen::Index i = 0; i < A.size(); ++i) add(A.data()[i]);
  }
  template <class T>
  void add(const std::vector<T>& list) {
    add(list.size());
    for (const T& entry : list) add(entry);
  }
  template <class T, size_t n>
  void add(const std::array<T, n>& list) {
    for (const T& entry : list) add(entry);
  }
  void add(const GeometricStiffness& value) {
    const auto& [spin, acceleration, angular_acceleration, markers] = value;
    all(spin, acceleration, angular_acceleration, markers);
  }
  void add(const MarkerStiffness& value) {
    const auto& [marker, force, torque] = value;
    all(marker, force, torque);
  }
  void add(const Coordinate& value) {
    const auto& [kind, frequency_hz, interface, direction] = value;
    all(kind, frequency_hz, interface, direction);
  }
  void add(const Interface& value) {
    const auto& [name, components, first_coordinate] = value;
    all(name, components, first_coordinate);
  }
  void add(const Marker& value) {
    const auto& [name, position, S, S_theta] = value;
    all(name, position, S, S_theta);
  }
  void add(const DisplayShape& value) {
    const auto& [points, S, S_theta, lines, triangles] = value;
    all(points, S, S_theta, lines, triangles);
  }
  void add(const Provenance& value) {
    const auto& [program, libraries, source, mesh_hash, options, doubts] = value;
    all(program, libraries, source, mesh_hash, options, doubts);
  }
  void add(const BodyCheck& value) {
    const auto& [name, number, reference, relative_error, passed] = value;
    all(name, number, reference, relative_error, passed);
  }
};

bool same(const ReducedBody& a, const ReducedBody& b) { return Bits(a).text == Bits(b).text; }

ReducedBody eq14_body() { return eq14::reduced_body({1.2, 0.3, 5.0}, 2, eq14::Planes::xy_and_xz, "boom"); }

ReducedBody beam_body() {
  const test::Boom boom = test::make_boom(test::boom4(BeamTheory::timoshenko, true));
  const ModalBasis basis = clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"),
                                         {.num_modes = 5, .sigma = {}, .backend = "arpack"});
  ReducedBody body = reduce(boom.mesh, boom.assembly, basis, "beam");
  body.certificate = check_invariants(body, boom.mesh, boom.assembly, basis);
  apply_damping(body, {"modal", 0.05});
  return body;
}

/// No coordinates, but points: shapes of no size.
ReducedBody hub() {
  ReducedBody body = rigid_body("hub", 8.5, {0.1, -0.0, 1e-300}, Eigen::Vector3d(2, 3, 4).asDiagonal().toDenseMatrix());
  body.display.points = Eigen::Matrix3d::Identity();
  body.display.S.assign(3, Eigen::Matrix3Xd(3, 0));
  body.display.triangles = {{0, 1, 2}};
  body.markers = {{"root", {0, 0, 1}, Eigen::Matrix3Xd(3, 0), Eigen::Matrix3Xd(3, 0)}};
  return body;
}

/// 100 k + 10 i + j: entries that tell where they are. body_file_open.py knows them.
template <class Matrix = Eigen::MatrixXd>
Matrix numbered(Eigen::Index rows, Eigen::Index cols, int k = 0) {
  Matrix A(rows, cols);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < cols; ++j) A(i, j) = 100 * k + 10 * static_cast<double>(i) + static_cast<double>(j);
  }
  return A;
}

template <class Matrix = Eigen::MatrixXd>
std::vector<Matrix> numbered_stack(int count, Eigen::Index rows, Eigen::Index cols) {
  std::vector<Matrix> result;
  for (int k = 0; k < count; ++k) result.push_back(numbered<Matrix>(rows, cols, k));
  return result;
}

/// A body with every field filled, and numbers that are easily lost. body_file_open.py knows them.
ReducedBody full_body() {
  ReducedBody body = eq14_body();
  const Eigen::Index n = body.n();
  body.name = "Ausleger \xCE\xB1 \"4\"\n";
  body.structure = "solid";
  body.frame = "free";
  body.De = numbered(n, n);
  body.De(0, 1) = -0.0;
  body.De(0, 2) = std::numeric_limits<double>::denorm_min();
  body.De(0, 3) = std::numeric_limits<double>::max();
  body.Kg.spin = numbered_stack(6, n, n);
  body.Kg.acceleration = numbered_stack(3, n, n);
  body.Kg.angular_acceleration = numbered_stack(3, n, n);
  body.Kg.markers = {{"tip", numbered_stack(3, n, n), numbered_stack(3, n, n)}, {"root", numbered_stack(3, n, n), {}}};
  const Eigen::MatrixXd z = numbered(4 + 3 * n, 4 + 3 * n);
  body.gram = z + z.transpose();
  body.coordinates = {{"interface", 0, "root", "ux"},
                      {"interface", 0, "root", "rz"},
                      {"bending_y", 1.0 / 3, "", ""},
                      {"attachment", 7, "tip", "Fx"}};
  body.interfaces = {{"root", {true, false, false, false, false, true}, 0}, {"tip", {}, -1}};
  body.markers = {{"tip", {1, 2, 3}, numbered<Eigen::Matrix3Xd>(3, n), numbered<Eigen::Matrix3Xd>(3, n, 1)},
                  {"root", {4, 5, 6}, numbered<Eigen::Matrix3Xd>(3, n, 2), numbered<Eigen::Matrix3Xd>(3, n, 3)}};
  body.display = {numbered<Eigen::Matrix3Xd>(3, 5),
                  numbered_stack<Eigen::Matrix3Xd>(5, 3, n),
                  numbered_stack<Eigen::Matrix3Xd>(5, 3, n),
                  {{0, 1, 2}, {}, {4, 3}},
                  {{0, 1, 2}, {2, 1, 4}}};
  body.provenance = {"flexboom 0.1.0", "HDF5 1.10", "boom.msh", "f00d", "modes = 4", "E = 1, rho = 1"};
  constexpr double inf = std::numeric_limits<double>::infinity();
  body.certificate = {{"m = t^T M t", 1, 2, 0.5, false}, {"", inf, -inf, std::nan("7"), true}};
  body.full_freedoms = 2'000'000'000;
  return body;
}

std::vector<ReducedBody> bodies() { return {eq14_body(), beam_body(), hub(), full_body()}; }

/// The message of the InputError that `f` throws, empty if it throws none.
std::string message(const std::function<void()>& f) {
  try {
    f();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

int python(const std::string& script, const fs::path& argument) {
  const std::string command =
      std::string(FLEXBOOM_PYTHON) + " -B " + FLEXBOOM_TEST_DATA + "/reduction/" + script + " " + argument.string();
  return std::system(command.c_str());
}

TEST(Sha256, GivesTheDigestsOfTheStandard) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1'000'000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesAddUp) {
  const std::string text(300, 'x');
  for (size_t piece = 1; piece < 140; ++piece) {
    Sha256 hash;
    for (size_t i = 0; i < text.size(); i += piece) hash.add(std::string_view(text).substr(i, piece));
    EXPECT_EQ(hash.digest(), sha256(text)) << piece;
  }
}

TEST(BodyFile, EveryBitComesBack) {
  const Folder folder;
  for (const ReducedBody& body : bodies()) {
    write_body_file(folder.path / "body.h5", body);
    EXPECT_TRUE(same(read_body_file(folder.path / "body.h5"), body)) << body.name;
  }
}

TEST(BodyFile, EqualBodiesMakeEqualFiles) {
  const Folder folder;
  for (const ReducedBody& body : bodies()) {
    write_body_file(folder.path / "a.h5", body);
    write_body_file(folder.path / "b.h5", read_body_file(folder.path / "a.h5"));
    EXPECT_EQ(text_of(folder.path / "a.h5"), text_of(folder.path / "b.h5")) << body.name;
  }
}

TEST(BodyFile, RicherBodiesComeBackWhereTheyWereGiven) {
  const Folder folder;
  const fs::path path = folder.path / "body.h5";
  const std::vector<ReducedBody> all = bodies();
  const std::optional<ReducedBody> none, one = all.at(1), other = all.back();
  for (const RicherBodies& richer : {RicherBodies{none, none}, {one, none}, {none, other}, {one, other}}) {
    write_body_file(path, full_body(), richer);
    const BodyFile file = read_whole_body_file(path);
    EXPECT_TRUE(same(file.body, full_body()));
    EXPECT_TRUE(same(read_body_file(path), full_body()));
    const auto comes_back = [](const std::optional<ReducedBody>& a, const std::optional<ReducedBody>& b) {
      return a ? b && same(*a, *b) : !b;
    };
    EXPECT_TRUE(comes_back(richer.more_modes, file.richer.more_modes));
    EXPECT_TRUE(comes_back(richer.finer_elements, file.richer.finer_elements));
    // What an older program cannot read has another version.
    EXPECT_TRUE(text_of(path).starts_with(richer.empty() ? "flexboom-body 1 " : "flexboom-body 2 "));
  }
  RicherBodies bad{one, none};
  bad.more_modes->m = -1;
  EXPECT_TRUE(says(message([&] { write_body_file(path, full_body(), bad); }), "m must be positive"));
}

TEST(BodyFile, PythonSeesTheDocumentedArrays) {
  const Folder folder;
  write_body_file(folder.path / "full.h5", full_body());
  EXPECT_EQ(python("body_file_open.py", folder.path / "full.h5"), 0);
  write_body_file(folder.path / "full.h5", full_body(), {.more_modes = full_body(), .finer_elements = {}});
  EXPECT_EQ(python("body_file_open.py", folder.path / "full.h5"), 0);
}

TEST(BodyFile, DamageIsRefusedOrHarmless) {
  const Folder folder;
  const fs::path path = folder.path / "body.h5";
  const ReducedBody body = full_body();
  write_body_file(path, body);
  const std::string good = text_of(path);
  std::mt19937_64 random(20201116);
  const auto below = [&](size_t n) { return static_cast<size_t>(random() % n); };
  const std::vector<std::function<void(std::string&)>> damages = {
      [&](std::string& s) { s[below(s.size())] ^= static_cast<char>(1U << below(8)); },
      [&](std::string& s) { s[below(512)] ^= static_cast<char>(1U << below(8)); },  // in the seal
      [&](std::string& s) {
        const size_t start = below(s.size());
        const size_t length = std::min(1 + below(4096), s.size() - start);
        s.replace(start, length, length, '\0');
      },
      [&](std::string& s) { s.resize(below(s.size())); },
      [&](std::string& s) {
        const size_t length = 1 + below(2048);
        const size_t a = below(s.size() - length), b = below(s.size() - length);
        const std::string at_a = s.substr(a, length), at_b = s.substr(b, length);
        s.replace(a, length, at_b).replace(b, length, at_a);
      },
      [&](std::string& s) {
        for (size_t i = 1 + below(100); i > 0; --i) s += static_cast<char>(below(256));
      }};
  int harmless = 0;
  for (size_t i = 0; i < 240; ++i) {
    std::string bad = good;
    damages[i % damages.size()](bad);
    put_text(path, bad);
    try {
      EXPECT_TRUE(same(read_body_file(path), body)) << "copy " << i;
      EXPECT_TRUE(bad == good) << "copy " << i;  // zeros on zeros
      ++harmless;
    } catch (const InputError& e) {
      EXPECT_TRUE(says(e.what(), path.string())) << e.what();
    }
  }
  EXPECT_LT(harmless, 60);
}

// Files changed with h5py, the seal made again or not; NAME.txt beside NAME.h5 says what the message must hold.
TEST(BodyFile, EveryChangeIsNamed) {
  const Folder folder;
  write_body_file(folder.path / "full.h5", full_body());
  ASSERT_EQ(python("body_file_damage.py", folder.path / "full.h5"), 0);
  int count = 0;
  for (const auto& entry : fs::directory_iterator(folder.path)) {
    if (entry.path().extension() != ".txt") continue;
    fs::path file = entry.path();
    file.replace_extension(".h5");
    const std::string text = message([&] { read_body_file(file); });
    EXPECT_TRUE(says(text, file.string() + ": ") && says(text, text_of(entry.path())))
        << file << "\n  says    " << text << "\n  must be " << text_of(entry.path());
    ++count;
  }
  EXPECT_GE(count, 20);
}

TEST(BodyFile, OtherFilesAreRefused) {
  const Folder folder;
  const fs::path path = folder.path / "body.h5";
  const auto read = [&] { read_body_file(path); };
  EXPECT_TRUE(says(message(read), "No such file"));
  put_text(path, "");
  EXPECT_TRUE(says(message(read), "empty"));
  put_text(path, "*HEADING\n");
  EXPECT_TRUE(says(message(read), "not a reduced body"));
  put_text(path, "flexboom-body 3 sha256 0\n");
  EXPECT_TRUE(says(message(read), "version 3")) << message(read);
  put_text(path, "flexboom-body 1 sha256 0\n");
  EXPECT_TRUE(says(message(read), "cut off")) << message(read);
  EXPECT_NE(message([&] { read_body_file(folder.path); }), "");
}

TEST(BodyFile, NothingIsLeftWhereNothingCanBeWritten) {
  const Folder folder;
  EXPECT_TRUE(
      says(message([&] { write_body_file(folder.path / "no" / "body.h5", hub()); }), "No such file or directory"));
  EXPECT_TRUE(says(message([] { write_body_file("/dev/full", hub()); }), "No space left on device"));
  EXPECT_TRUE(fs::is_empty(folder.path));
}

TEST(BodyFile, BadBodiesAreNotWritten) {
  const Folder folder;
  const fs::path path = folder.path / "body.h5";
  write_body_file(path, hub());
  const std::vector<std::pair<std::string, std::function<void(ReducedBody&)>>> faults = {
      {"m must be positive", [](ReducedBody& b) { b.m = -1; }},
      {"Ct", [](ReducedBody& b) { b.Ct.conservativeResize(3, 1); }},
      {"Kg.spin has 5 matrices, must have 6 or none", [](ReducedBody& b) { b.Kg.spin.pop_back(); }},
      {"Kg of marker \"root\" force is 2 x 2, must be 4 x 4",
       [](ReducedBody& b) { b.Kg.markers[1].force[2].resize(2, 2); }},
      {"Kg.acceleration has entries that are not finite",
       [](ReducedBody& b) { b.Kg.acceleration[2](1, 1) = std::nan(""); }},
      {"coordinates/frequency_hz", [](ReducedBody& b) { b.coordinates[0].frequency_hz = std::nan(""); }},
      {"display/S_theta", [](ReducedBody& b) { b.display.S_theta.pop_back(); }},
      {"display/lines has point 5 of 5", [](ReducedBody& b) { b.display.lines[0][0] = 5; }},
      {"display/triangles has point -1 of 5", [](ReducedBody& b) { b.display.triangles[0][0] = -1; }},
      {"zero byte", [](ReducedBody& b) { b.provenance.source = std::string("t\0p", 3); }},
      {"zero byte", [](ReducedBody& b) { b.frame = std::string("\0", 1); }},
  };
  for (const auto& [text, damage] : faults) {
    ReducedBody body = full_body();
    damage(body);
    const std::string said = message([&] { write_body_file(path, body); });
    EXPECT_TRUE(says(said, text) && says(said, path.string())) << said << "\n  must be " << text;
  }
  EXPECT_TRUE(same(read_body_file(path), hub()));
}

}  // namespace
}  // namespace flexboom
