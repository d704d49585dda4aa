#include "fem/base/blas_threads.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string_view>
#include <thread>

namespace flexboom {
namespace {

constexpr const char* kernels_variable = "OPENBLAS_CORETYPE";

// Looked up by name, so that any BLAS will do and none has to be OpenBLAS.
template <class Function>
Function library(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
}

/// Depth of nested parallel regions that OpenMP starts threads for; nothing where the program has no OpenMP.
int openmp_levels() {
  const auto get = library<int (*)()>("omp_get_max_active_levels");
  return get ? get() : 0;
}

void set_openmp_levels(int levels) {
  if (const auto set = library<void (*)(int)>("omp_set_max_active_levels")) set(levels);
}

std::string openblas_text(const char* name) {
  const auto text = library<const char* (*)()>(name);
  return text ? text() : "";
}

/// What the processor says that it can do, " word word ... "; empty where the system does not tell.
std::string processor_flags() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("flags")) return line.substr(line.find(':') + 1) + ' ';
  }
  return "";
}

}  // namespace

int idle_cores() {
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  double load = 0;
  if (getloadavg(&load, 1) != 1) return 1;
  return std::max(1, cores - static_cast<int>(std::lround(load)));
}

int set_blas_threads(int wanted) {
  const int threads = std::max(1, std::min(wanted, idle_cores()));
  if (const auto set = library<void (*)(int)>("openblas_set_num_threads")) set(threads);
  return threads;
}

WithoutOpenMP::WithoutOpenMP() : levels_(openmp_levels()) { set_openmp_levels(0); }

WithoutOpenMP::~WithoutOpenMP() { set_openmp_levels(levels_); }

OneBlasThread::OneBlasThread() {
  static const auto get = library<int (*)()>("openblas_get_num_threads");
  static const auto set = library<void (*)(int)>("openblas_set_num_threads");
  if (get && set && (threads_ = get()) > 1) set(1);
}

OneBlasThread::~OneBlasThread() {
  static const auto set = library<void (*)(int)>("openblas_set_num_threads");
  if (threads_ > 1) set(threads_);
}

std::string blas_release() {
  std::istringstream config(openblas_text("openblas_get_config"));
  std::string name, version;
  if (!(config >> name >> version)) return "unknown";
  return fmt::format("{} {}, {} kernels", name, version, openblas_text("openblas_get_corename"));
}

std::string better_blas_kernels() {
  constexpr std::array<std::string_view, 3> fallbacks = {"Prescott", "Nehalem", "Sandybridge"};
  if (std::ranges::find(fallbacks, openblas_text("openblas_get_corename")) == fallbacks.end()) return "";
  const std::string flags = processor_flags();
  const auto all = [&](std::initializer_list<const char*> names) {
    return std::ranges::all_of(
        names, [&](const char* name) { return flags.find(fmt::format(" {} ", name)) != std::string::npos; });
  };
  if (!all({"avx2", "fma"})) return "";
  return all({"avx512f", "avx512dq", "avx512bw", "avx512vl"}) ? "SkylakeX" : "Haswell";
}

void restart_with_better_blas_kernels(char** argv) {
  if (std::getenv(kernels_variable)) return;
  const std::string kernels = better_blas_kernels();
  if (kernels.empty() || setenv(kernels_variable, kernels.c_str(), 1) != 0) return;
  execv("/proc/self/exe", argv);
  unsetenv(kernels_variable);  // only reached when the system refused
}

}  // namespace flexboom
