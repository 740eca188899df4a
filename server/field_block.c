/* Names are compared by their addresses: they are constants, so that the same name is mostly the same text in
 * the same place. Where it is not, the block is printed anew, with the same bytes. */
#include "field_block.h"

#include <string.h>

/* Whether nothing in it ends a field, or could. */
static bool is_plain(const char *value, size_t size) {
  uint8_t control = 0;
  for (size_t i = 0; i < size; i++) control |= (uint8_t)((uint8_t)value[i] < 0x20);
  return control == 0;
}

static bool add_text(srv_field_block *block, const char *text, size_t size) {
  if (size > sizeof block->text - block->size) return false;
  memcpy(block->text + block->size, text, size);
  block->size += size;
  return true;
}

static bool add_field(srv_field_block *block, const api_header *field) {
  bool is_first = block->count == 0;
  size_t size = strlen(field->value);
  if (!is_plain(field->value, size)) return false;
  if (!is_first && !add_text(block, "\r\n", 2)) return false;
  if (!is_first && !add_text(block, field->name, strlen(field->name))) return false;
  if (!is_first && !add_text(block, ": ", 2)) return false;
  block->fields[block->count].name = field->name;
  block->fields[block->count].at = block->size;
  block->fields[block->count].size = size;
  block->count++;
  return add_text(block, field->value, size);
}

static bool print_anew(srv_field_block *block, const api_header *fields, size_t count) {
  block->count = block->size = 0;
  bool fits = count > 0 && count <= SRV_FIELDS_MAX;
  for (size_t i = 0; fits && i < count; i++) fits = add_field(block, &fields[i]);
  if (!fits) block->count = block->size = 0;
  return fits;
}

bool srv_field_block_set(srv_field_block *block, const api_header *fields, size_t count) {
  if (count != block->count) return print_anew(block, fields, count);
  for (size_t i = 0; i < count; i++) {
    const char *value = fields[i].value;
    size_t size = strlen(value);
    if (fields[i].name != block->fields[i].name || size != block->fields[i].size)
      return print_anew(block, fields, count);
    char *kept = block->text + block->fields[i].at;
    if (memcmp(kept, value, size) == 0) continue;
    if (!is_plain(value, size)) return print_anew(block, fields, count);
    memcpy(kept, value, size);
  }
  return count > 0;
}
