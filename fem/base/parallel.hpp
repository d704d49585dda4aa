#pragma once

#include "fem/base/blas_threads.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace flexboom {

/// Calls body(i) for i in [0, count) on `threads` threads in blocks of `grain`. The first exception is thrown again
/// here. Dense kernels run on the thread that calls them meanwhile.
template <class Body>
void parallel_for(int threads, int count, int grain, const Body& body) {
  std::atomic<int> next = 0;
  std::exception_ptr failure;
  std::mutex guard;
  const auto work = [&] {
    try {
      for (int first = next.fetch_add(grain); first < count; first = next.fetch_add(grain)) {
        const int last = std::min(count, first + grain);
        for (int i = first; i < last; ++i) body(i);
      }
    } catch (...) {
      const std::lock_guard lock(guard);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  const int wanted = std::min(threads, (count + grain - 1) / grain);
  std::optional<OneBlasThread> alone;
  if (wanted > 1) alone.emplace();
  std::vector<std::jthread> helpers;
  for (int t = 1; t < wanted; ++t) helpers.emplace_back(work);
  work();
  helpers.clear();  // joins
  if (failure) std::rethrow_exception(failure);
}

}  // namespace flexboom
