// Times of repeated work: median, least and most.
#ifndef TWEEND_TIMING_HPP
#define TWEEND_TIMING_HPP

#include <algorithm>
#include <chrono>
#include <vector>

struct Timing {
  double median, low, high; // seconds

  double spread() const { return (high - low) / median; }
};

// The first run, which warms caches and buffers up, is not counted.
template <typename Work> Timing measure(const Work &work, int runs = 7) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> times;
  for (int i = 0; i <= runs; i++) {
    Clock::time_point start = Clock::now();
    work();
    times.push_back(std::chrono::duration<double>(Clock::now() - start).count());
  }
  times.erase(times.begin());
  std::sort(times.begin(), times.end());
  return {times[times.size() / 2], times.front(), times.back()};
}

#endif
