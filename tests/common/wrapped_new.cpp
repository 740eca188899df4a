// Makes operator new in the project's own C++ fail where the wrapped malloc (wrapped_memory.h) would. Not in
// tinygltf: it allocates in destructors, and an exception there ends the process.
#include <new>

extern "C" {
bool test_memory_fails(std::size_t size); // see wrapped_memory.h

// The linker's --wrap gives these names.
// NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp)
void *__real__Znwm(std::size_t size);
void *__wrap__Znwm(std::size_t size);
}

void *__wrap__Znwm(std::size_t size) {
  if (test_memory_fails(size)) throw std::bad_alloc();
  return __real__Znwm(size);
}
// NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp)
