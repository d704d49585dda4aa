#include "apps/base/version.hpp"

#include "fem/linear_algebra/inertia.hpp"

#include <Spectra/Util/Version.h>
#include <fmt/format.h>
#include <openssl/opensslv.h>
#include <sqlite3.h>
#include <sundials/sundials_config.h>
#include <toml++/impl/version.h>
#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <map>
#include <string>

namespace flexboom {

std::string version_text() {
  std::string t = fmt::format("flexboom {}  (BSD-3-Clause)\n", version);
  const auto line = [&](const char* name, const std::string& v, const char* licence) {
    t += fmt::format("  {:<16} {:<8} {}\n", name, v, licence);
  };
  line("Eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION), "MPL-2.0");
  // Those of the system that runs the program.
  std::map<std::string, std::string> running;
  for (const auto& [name, release] : linear_algebra_versions()) running[name] = release;
  line("CHOLMOD", running["cholmod"], "LGPL-2.1+ (Core, Cholesky), GPL-2.0+ (Supernodal, MatrixOps)");
  // What CHOLMOD and ARPACK bring along.
  line("AMD, COLAMD", "", "BSD-3-Clause (with CAMD, CCOLAMD)");
  line("METIS", "", "Apache-2.0");
  if (running.contains("mumps")) line("MUMPS", running["mumps"], "CeCILL-C (sequential)");
  line("pugixml, zlib", "", "MIT, zlib");
  line("HDF5, matio", "", "BSD-3-Clause, BSD-2-Clause");
  line("BLAS, LAPACK", "", fmt::format("{}; OpenBLAS is BSD-3-Clause", running["blas"]).c_str());
  line("LAPACKE", "", "BSD-3-Clause");
  line("OpenSSL", OPENSSL_VERSION_STR, "Apache-2.0 (libcrypto)");
  line("GNU runtime", "", "GPL-3.0+ with the runtime exception (libgomp, libgfortran)");
  line("ARPACK-NG", "3.8", "BSD-3-Clause");
  line("Spectra", fmt::format("{}.{}.{}", SPECTRA_MAJOR_VERSION, SPECTRA_MINOR_VERSION, SPECTRA_PATCH_VERSION),
       "MPL-2.0");
  line("muParser", "", "BSD-2-Clause");
  line("SQLite", sqlite3_libversion(), "public domain");
  line("SUNDIALS", SUNDIALS_VERSION, "BSD-3-Clause");
  line("CLI11", CLI11_VERSION, "BSD-3-Clause");
  line("toml++", fmt::format("{}.{}.{}", TOML_LIB_MAJOR, TOML_LIB_MINOR, TOML_LIB_PATCH), "MIT");
  line("nlohmann-json",
       fmt::format("{}.{}.{}", NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH),
       "MIT");
  line("fmt", fmt::format("{}.{}.{}", FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100), "MIT");
  t += "The source of flexboom is BSD-3-Clause. CHOLMOD's supernodal part is GPL: it makes this binary, as linked, "
       "GPL.\n";
  return t;
}

}  // namespace flexboom
