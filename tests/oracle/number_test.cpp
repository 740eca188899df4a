// Floats must print as std::to_chars prints them, to the byte. TAP; with the argument "all" every float is
// printed, which takes minutes.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>
#include <string_view>

#include "number.h"
#include "tweend/base.h"

namespace {

int tests = 0, failures = 0;
uint64_t compared = 0;

float float_of(uint32_t bits) {
  float value = 0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

std::string printed(float value) {
  char text[TW_NUMBER_TEXT];
  return std::string(text, tw_print_float(text, value));
}

std::string expected(float value) {
  if (!std::isfinite(value)) return "null";
  if (value == 0) return "0";
  char text[64];
  return std::string(text, std::to_chars(text, text + sizeof text, value).ptr);
}

// Prints floats in rows and in vectors of four, on every instruction set of the processor.
class rows {
public:
  void add(float value) {
    values[count++] = value;
    if (count == values.size()) compare_row();
  }

  std::string finish() {
    compare_row();
    return failure;
  }

private:
  static constexpr size_t WIDTH = 4, VECTORS = 250;

  void compare_row() {
    compared += count;
    std::string row = "[", vectors;
    for (size_t i = 0; i < count; i++) {
      std::string number = expected(values[i]);
      row.append(i ? "," : "").append(number);
      if (i < count / WIDTH * WIDTH)
        vectors.append(i % WIDTH == 0 ? "[" : "").append(number).append(i % WIDTH == WIDTH - 1 ? "]," : ",");
    }
    row.append("],");
    for (uint32_t set = 0; tw_number_printer *print = tw_number_printer_at(set); set++) {
      tw_vectors one = {values.data(), count, count, 1, nullptr};
      compare_text(row, print(text.data(), &one));
      tw_vectors all = {values.data(), WIDTH, WIDTH, count / WIDTH, nullptr};
      compare_text(vectors, print(text.data(), &all));
    }
    count = 0;
  }

  void compare_text(const std::string &right, const char *end) {
    std::string_view found(text.data(), static_cast<size_t>(end - text.data()));
    if (found == right || !failure.empty()) return;
    size_t place = 0;
    while (place < std::min(found.size(), right.size()) && found[place] == right[place]) place++;
    size_t start = place < 16 ? 0 : place - 16;
    failure.assign(found.substr(start, 32)).append(" in place of ").append(right, start, 32);
  }

  std::array<float, VECTORS *WIDTH> values = {};
  std::array<char, VECTORS *(WIDTH *TW_FLOAT_TEXT + 3)> text = {};
  size_t count = 0;
  std::string failure;
};

// Compares each float on its own and in rows.
struct comparison {
  std::string failure;
  rows others;
};

void compare(float value, comparison &with) {
  compared++;
  with.others.add(value);
  std::string text = printed(value), right = expected(value);
  if (text != right && with.failure.empty()) with.failure = text + " in place of " + right;
}

void report(const char *name, const std::string &failure) {
  bool passed = failure.empty();
  failures += passed ? 0 : 1;
  std::printf("%sok %d - %s\n", passed ? "" : "not ", ++tests, name);
  if (!passed) std::printf("# %s\n", failure.c_str());
}

void report(const char *name, comparison &of) {
  report(name, of.failure.empty() ? of.others.finish() : of.failure);
}

// Floats of any magnitude, of the magnitudes of poses, and with few digits, whose trailing zeros are dropped.
void compare_random(int count) {
  std::mt19937 random(20261121);
  comparison any, near, few;
  for (int i = 0; i < count; i++) {
    compare(float_of(static_cast<uint32_t>(random())), any);
    compare(std::ldexp(static_cast<float>(static_cast<int32_t>(random())), -static_cast<int>(random() % 50)),
            near);
    float divisor = std::pow(10.0F, static_cast<float>(random() % 8));
    compare(static_cast<float>(random() % 100000) / divisor, few);
  }
  report("random floats print as to_chars prints them", any);
  report("random floats of a pose's magnitude print as to_chars prints them", near);
  report("random short decimals print as to_chars prints them", few);
}

void compare_edges() {
  comparison powers, special;
  for (uint32_t exponent = 0; exponent < 512; exponent++)
    for (uint32_t step = 0; step < 64; step++) compare(float_of((exponent << 23) + step - 32), powers);
  report("floats around powers of two print as to_chars prints them", powers);
  for (int power = -45; power <= 38; power++)
    for (int factor = 1; factor < 100; factor++) {
      float value = std::strtof((std::to_string(factor) + "e" + std::to_string(power)).c_str(), nullptr);
      for (float sign : {1.0F, -1.0F})
        for (float near : {std::nextafter(value, 0.0F), value, std::nextafter(value, INFINITY)})
          compare(sign * near, special);
    }
  for (float value : {0.0F, -0.0F, INFINITY, -INFINITY, NAN}) compare(value, special);
  report("floats around powers of ten, and what is no number, print as to_chars prints them", special);
}

// From 2^-14 to 2^18, a wider range than that of the kernel. Floats half way between two decimals have zeros
// in their last bits.
void compare_magnitudes() {
  rows spread, middles;
  for (uint32_t exponent = 113; exponent <= 145; exponent++) {
    for (uint32_t bits = 0; bits < 1U << 23; bits += 29)
      spread.add(float_of(bits % 2 << 31 | exponent << 23 | bits));
    for (uint32_t bits = 0; bits < 1U << 23; bits += 1U << 7) middles.add(float_of(exponent << 23 | bits));
  }
  report("rows of floats of each magnitude print as to_chars prints them", spread.finish());
  report("rows of floats in the middle between decimals print as to_chars prints them", middles.finish());
}

void compare_all() {
  rows all;
  uint32_t bits = 0;
  do all.add(float_of(bits));
  while (++bits != 0);
  report("every float prints as to_chars prints it", all.finish());
}

} // namespace

int main(int argc, char **argv) {
  compare_random(200000);
  compare_edges();
  compare_magnitudes();
  if (argc > 1 && std::strcmp(argv[1], "all") == 0) compare_all();
  std::printf("1..%d\n# %llu floats compared\n", tests, static_cast<unsigned long long>(compared));
  return failures ? 1 : 0;
}
