#pragma once

#include <string>

namespace flexboom {

/// Threads of the dense kernels under the sparse factorisation (OpenBLAS, where it is what is installed). No more than
/// there are idle cores now, since its threads wait by spinning. On a busy machine two of them were seen ten times
/// slower than one. Returns the number that was set.
int set_blas_threads(int wanted);

/// Cores that nobody uses, from the load average of the last minute; at least 1.
int idle_cores();

/// While one lives, OpenMP regions entered from this thread run on it alone. CHOLMOD asks for four threads, whatever
/// the machine has, for loops of microseconds. Its factorisations were seen to take 1.3 to 1.8 times as long with them.
/// They take longer still on a busy machine, where waiting threads spin.
class WithoutOpenMP {
 public:
  WithoutOpenMP();
  ~WithoutOpenMP();
  WithoutOpenMP(const WithoutOpenMP&) = delete;
  WithoutOpenMP& operator=(const WithoutOpenMP&) = delete;

 private:
  int levels_;
};

/// While one lives, dense kernels run on the thread that calls them. Several threads that call them at once wait for
/// each other's helpers by spinning: ten times slower. Made outside the threads.
class OneBlasThread {
 public:
  OneBlasThread();
  ~OneBlasThread();
  OneBlasThread(const OneBlasThread&) = delete;
  OneBlasThread& operator=(const OneBlasThread&) = delete;

 private:
  int threads_ = 1;
};

/// The BLAS in use and its kernels, "OpenBLAS 0.3.21, SkylakeX kernels"; "unknown" for another than OpenBLAS.
std::string blas_release();

/// The kernels that OpenBLAS should run here, in the words of OPENBLAS_CORETYPE; empty when it runs them or is not what
/// is installed. Releases before 0.3.25 run kernels of 2004 (SSE3) on processors newer than themselves (OpenBLAS issue
/// 4267): a factorisation then takes twice as long.
std::string better_blas_kernels();

/// For the first line of main(): starts the program anew with OPENBLAS_CORETYPE set where better_blas_kernels() names
/// some, for OpenBLAS reads it when it is loaded. Returns when there is nothing to gain, when the variable is set
/// already, or when the system refuses.
void restart_with_better_blas_kernels(char** argv);

}  // namespace flexboom
