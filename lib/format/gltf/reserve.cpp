// operator new and delete of the program: as ever, but charged to the meter and with a reserve for the thread
// that reads a glTF.
#include "gltf/reserve.hpp"

#include <cstdlib>
#include <new>

#include "tweend/base.h"

namespace gltf {

namespace {

thread_local Reserve *current;

} // namespace

Reserve::Reserve() {
  current = this;
}

Reserve::~Reserve() {
  current = nullptr;
  tw_free(begin_);
}

bool Reserve::fill(std::uint64_t bytes) {
  begin_ = bytes < SIZE_MAX ? static_cast<char *>(tw_alloc(static_cast<std::size_t>(bytes), 1)) : nullptr;
  next_ = begin_;
  end_ = begin_ ? begin_ + bytes : nullptr;
  return begin_ != nullptr;
}

void *Reserve::take(std::size_t bytes) {
  constexpr std::size_t alignment = alignof(std::max_align_t);
  std::size_t whole = (bytes + alignment - 1) / alignment * alignment;
  // The second half is for what runs once an allocation has failed.
  std::size_t left = static_cast<std::size_t>(end_ - next_),
              kept = has_failed_ ? 0 : static_cast<std::size_t>(end_ - begin_) / 2;
  if (whole < bytes || left < kept || whole > left - kept) {
    has_failed_ = true;
    return nullptr;
  }
  void *memory = next_;
  next_ += whole;
  return memory;
}

bool Reserve::owns(const void *memory) const {
  return memory >= begin_ && memory < end_;
}

Reserve *Reserve::of_thread() {
  return current;
}

} // namespace gltf

// All forms that do not align are replaced: the sanitizers tell memory of their own forms from that of
// malloc.

void *operator new(std::size_t size, const std::nothrow_t &) noexcept {
  gltf::Reserve *reserve = gltf::Reserve::of_thread();
  if (!reserve) return std::malloc(size > 0 ? size : 1);
  void *memory = tw_alloc(size, 1);
  return memory ? memory : reserve->take(size);
}

void *operator new(std::size_t size) {
  void *memory = operator new(size, std::nothrow);
  if (!memory) throw std::bad_alloc();
  return memory;
}

void *operator new[](std::size_t size, const std::nothrow_t &tag) noexcept {
  return operator new(size, tag);
}
void *operator new[](std::size_t size) {
  return operator new(size);
}

void operator delete(void *memory) noexcept {
  const gltf::Reserve *reserve = gltf::Reserve::of_thread();
  if (!reserve)
    std::free(memory);
  else if (!reserve->owns(memory))
    tw_free(memory);
}

void operator delete(void *memory, std::size_t) noexcept {
  operator delete(memory);
}
void operator delete(void *memory, const std::nothrow_t &) noexcept {
  operator delete(memory);
}
void operator delete[](void *memory) noexcept {
  operator delete(memory);
}
void operator delete[](void *memory, std::size_t) noexcept {
  operator delete(memory);
}
void operator delete[](void *memory, const std::nothrow_t &) noexcept {
  operator delete(memory);
}
