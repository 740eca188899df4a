// Times of repeated work: median, least and most, without the fastest and the slowest twentieth.
#ifndef TWEEND_TIMING_HPP
#define TWEEND_TIMING_HPP

#include <algorithm>
#include <array>
#include <chrono>
#include <vector>

#include "report.h"

struct Timing {
  double median, low, high; // seconds

  double spread() const { return (high - low) / median; }
};

// Runs the works in turn, so that a slow minute of the machine does not hit only one of them: at least
// BENCH_RUNS times each, until they have taken a quarter of a second. The first run, which warms caches and
// buffers up, does not count.
template <typename... Works> std::array<Timing, sizeof...(Works)> measure_by_turns(const Works &...works) {
  constexpr size_t RUNS = BENCH_RUNS;
  constexpr double SECONDS = 0.25;
  using Clock = std::chrono::steady_clock;
  std::array<std::vector<double>, sizeof...(Works)> times;
  auto run = [](const auto &work, std::vector<double> &out) {
    Clock::time_point start = Clock::now();
    work();
    out.push_back(std::chrono::duration<double>(Clock::now() - start).count());
  };
  auto turn = [&] {
    size_t next = 0;
    (run(works, times[next++]), ...);
  };
  turn();
  for (std::vector<double> &each : times) each.clear();
  for (Clock::time_point begin = Clock::now();
       times[0].size() < RUNS || Clock::now() - begin < std::chrono::duration<double>(SECONDS);)
    turn();
  std::array<Timing, sizeof...(Works)> out;
  std::transform(times.begin(), times.end(), out.begin(), [](std::vector<double> &each) {
    std::sort(each.begin(), each.end());
    size_t apart = each.size() / 20;
    return Timing{each[each.size() / 2], each[apart], each[each.size() - 1 - apart]};
  });
  return out;
}

template <typename Work> Timing measure(const Work &work) {
  return measure_by_turns(work)[0];
}

#endif
