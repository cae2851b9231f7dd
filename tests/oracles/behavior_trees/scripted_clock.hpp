// RateController asks std::chrono::high_resolution_clock: here it gets one that the tracer sets.
#pragma once
#include <chrono>

namespace std::chrono {
struct scripted_clock {
  using duration = nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = chrono::time_point<scripted_clock>;
  static constexpr bool is_steady = true;
  static inline duration time{0};
  static time_point now() { return time_point(time); }
};
}  // namespace std::chrono

#define high_resolution_clock scripted_clock
