// Memory for the allocations of C++ that malloc or the meter refuses while a glTF is read: tinygltf allocates
// in destructors, also while an exception unwinds, where a further exception would end the process. While a
// reserve lives, all that C++ allocates on its thread is charged to the meter of the work.
#ifndef TWEEND_GLTF_RESERVE_HPP
#define TWEEND_GLTF_RESERVE_HPP

#include <cstddef>
#include <cstdint>

namespace gltf {

// The reserve of this thread while it lives; one at a time. What is taken from it, or allocated meanwhile,
// has to be freed before, on this thread.
class Reserve {
public:
  Reserve();
  Reserve(const Reserve &) = delete;
  Reserve &operator=(const Reserve &) = delete;
  ~Reserve();

  bool fill(std::uint64_t bytes); // once, or never; false: they cannot be had
  void *take(std::size_t bytes);  // nullptr: what is left is too little
  bool owns(const void *memory) const;
  bool has_failed() const { return has_failed_; }

  static Reserve *of_thread(); // or nullptr

private:
  char *begin_ = nullptr, *next_ = nullptr, *end_ = nullptr;
  bool has_failed_ = false;
};

} // namespace gltf

#endif
