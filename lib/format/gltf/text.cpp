// Decodes strings, numbers and base64 of JSON text; copies names.
#include "gltf/document.hpp"

#include <cmath>

#include "tweend/base.h"

namespace gltf {

namespace {

int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

// Reads the base64 digit at `at` and moves behind it; -1 at the end of the text and for other characters.
// "\/" is a slash.
int next_digit(std::string_view written, size_t &at) {
  if (at + 1 < written.size() && written[at] == '\\' && written[at + 1] == '/') at++;
  return at < written.size() ? base64_digit(written[at++]) : -1;
}

} // namespace

Vector<uint8_t> decode_base64(std::string_view written, Budget &budget, std::string_view *rest) {
  size_t digits = 0, end = 0;
  for (size_t at = 0; next_digit(written, at) >= 0; end = at) digits++;
  work(digits);
  if (rest) *rest = written.substr(end);
  Vector<uint8_t> out(budget, digits * 6 / 8);
  uint32_t bits = 0, count = 0;
  size_t at = 0;
  for (uint8_t &byte : out) {
    work(1);
    for (; count < 8; count += 6) bits = bits << 6 | static_cast<uint32_t>(next_digit(written, at));
    count -= 8;
    byte = static_cast<uint8_t>(bits >> count);
  }
  return out;
}

std::string unescape(std::string_view written) {
  std::string out(written.size(), '\0');
  out.resize(static_cast<size_t>(tw_json_unescape(written.data(), written.size(), out.data()) - out.data()));
  return out;
}

const char *image_type(const Bytes &file) {
  using namespace std::string_view_literals;
  static constexpr struct {
    const char *type;
    size_t at; // "WEBP" is behind "RIFF" and a size, "ftypavif" behind the size of a box
    std::string_view magic;
  } known[] = {{"image/png", 0, "\x89PNG"sv},
               {"image/jpeg", 0, "\xFF\xD8\xFF"sv},
               {"image/ktx2", 0, "\xABKTX 20\xBB\r\n\x1A\n"sv},
               {"image/vnd-ms.dds", 0, "DDS "sv},
               {"image/webp", 8, "WEBP"sv},
               {"image/avif", 4, "ftypavif"sv}};
  std::string_view bytes(reinterpret_cast<const char *>(file.data), file.size);
  for (const auto &[type, at, magic] : known)
    if (bytes.size() >= at && bytes.substr(at, magic.size()) == magic &&
        (at != 8 || bytes.substr(0, 4) == "RIFF"))
      return type;
  return nullptr;
}

bool has_word(std::string_view list, std::string_view word) {
  if (word.find(' ') != std::string_view::npos) return false; // several of the list
  for (size_t at = list.find(word); at != std::string_view::npos; at = list.find(word, at + 1)) {
    size_t end = at + word.size();
    if ((at == 0 || list[at - 1] == ' ') && (end == list.size() || list[end] == ' ')) return true;
  }
  return false;
}

std::string in_lower_case(std::string_view text) {
  std::string lower(text);
  for (char &letter : lower)
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter + ('a' - 'A'));
  return lower;
}

bool has_scheme(std::string_view uri, std::string_view scheme) {
  return in_lower_case(uri.substr(0, scheme.size())) == scheme;
}

bool is_track(const char *channel) {
  const char *target = tw_json_member(channel, "target");
  const char *node = tw_json_member(target, "node");
  const char *path = tw_json_member(target, "path");
  return node && path && *path == '"' && has_word("translation rotation scale weights", string_of(path));
}

std::optional<uint64_t> whole_number(const char *value) {
  double number;
  if (!value || !tw_json_is_number(value)) return {};
  tw_json_number(value, &number);
  if (!(number >= 0 && number <= 9007199254740992.0) || number != std::floor(number)) return {};
  return static_cast<uint64_t>(number);
}

const char *compression_of(const char *view) {
  const char *extensions = tw_json_member(view, "extensions");
  const char *ext = tw_json_member(extensions, "EXT_meshopt_compression");
  return ext ? ext : tw_json_member(extensions, "KHR_meshopt_compression");
}

namespace {

// Members that hold an index, a count or a number of an enumeration.
constexpr char integer_members[] =
    "bufferView byteOffset componentType count byteLength byteStride buffer target sampler node input output "
    "material indices mode mesh skin camera scene source index texCoord magFilter minFilter wrapS wrapT "
    "inverseBindMatrices skeleton light";

// Copies a document, and counts the numbers that it writes anew.
class IntegerWriter : Text {
public:
  explicit IntegerWriter(Budget &budget) : Text(budget) {}

  size_t run(const char *root, Vector<char> &out) {
    text_.reserve(value_text(root).size());
    copy(root, false);
    if (count_ > 0) out = std::move(text_);
    return count_;
  }

private:
  size_t count_ = 0;

  // are_integers: numbers in the value, and in arrays and objects inside it, are.
  void copy(const char *value, bool are_integers) {
    if (*value == '{' || *value == '[') return copy_items(value, are_integers);
    std::string_view written = value_text(value);
    std::optional<uint64_t> number;
    if (are_integers && written.find_first_of(".eE") != std::string_view::npos) number = whole_number(value);
    count_ += number.has_value();
    if (number)
      put(text(*number));
    else
      put(written);
  }

  void copy_items(const char *value, bool are_integers) {
    bool is_object = *value == '{';
    put(is_object ? "{" : "[");
    for (Items i(value); i.more(); i.next()) {
      if (is_object)
        put_key(i.key());
      else
        put_comma();
      if (is_object && i.key() == "extras")
        put(value_text(i.value()));
      else
        copy(i.value(), is_object ? is_integer(i, are_integers) : are_integers);
    }
    put(is_object ? "}" : "]");
  }

  static bool is_integer(const Items &member, bool are_integers) {
    if (*member.value() == '{') return member.key() == "attributes";
    if (*member.value() == '[') return has_word("children nodes joints targets", member.key());
    return are_integers || has_word(integer_members, member.key());
  }
};

} // namespace

void drop_blanks(const char *root, Vector<char> &out) {
  std::string_view written = value_text(root);
  const char *end = written.data() + written.size();
  // Calls value(text) for all text between blanks.
  auto each_run = [&](auto put) {
    for (const char *at = root; at < end;) {
      const char *from = at;
      if (tw_json_is_blank(*at)) {
        while (at < end && tw_json_is_blank(*at)) at++;
      } else {
        while (at < end && !tw_json_is_blank(*at)) at = *at == '"' ? tw_json_skip(at) : at + 1;
        put(from, at);
      }
      work(1 + static_cast<uint64_t>(at - from) / 8);
    }
  };
  uint64_t kept = 0;
  each_run([&](const char *from, const char *to) { kept += static_cast<uint64_t>(to - from); });
  if (kept >= written.size() / 2) return;
  out.reserve(static_cast<size_t>(kept));
  each_run([&](const char *from, const char *to) { out.insert(out.end(), from, to); });
}

size_t write_integers(const char *root, Budget &budget, Vector<char> &out) {
  return value_text(root).find(".0") == std::string_view::npos ? 0 : IntegerWriter(budget).run(root, out);
}

int index_of(const char *value) {
  std::optional<uint64_t> number = whole_number(value);
  return number && *number < INT32_MAX ? static_cast<int>(*number) : -1;
}

std::string printable(std::string text) {
  if (!tw_utf8_is_name(text.data(), text.size()))
    for (char &c : text)
      if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7F) c = '?';
  return text;
}

std::string pointer_part(const std::string &name) {
  std::string part;
  for (char c : name) part += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return part;
}

const char *copy_name_of(Document &document, const char *object) {
  const char *name = nullptr;
  for (Items i(object); i.more(); i.next())
    if (i.key() == "name" || (is_escaped(i.key()) && unescape(i.key()) == "name")) name = i.value();
  return name && *name == '"' ? copy_name(document, unescape(string_of(name))) : nullptr;
}

const char *copy_name(Document &document, const std::string &name) {
  if (name.empty()) return nullptr;
  document.budget.take(name.size() + 17);
  const char *copy = tw_take_name(&document.outline.losses, document.model->arena, name.data(), name.size());
  if (!copy) throw std::bad_alloc();
  return copy;
}

} // namespace gltf
