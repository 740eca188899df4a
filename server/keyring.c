/* A list on the command line holds only keys, separated by commas. A file holds one key a line, besides blank
 * lines and comments; a line of --api-keys is KEY [RIGHTS] [RATE], and a key without rights may do
 * everything. Error texts give the number of the line or item and never show its content. */
#include "keyring.h"

#include "disk.h"

#include <stdlib.h>
#include <string.h>

enum { FILE_MAX = 1 << 20 };

static const unsigned ALL_RIGHTS = API_MAY_READ | API_MAY_WRITE | API_MAY_DELETE;
static const char blanks[] = " \t\r\n";

static bool is_key(const char *word) {
  return word[strcspn(word, blanks)] == '\0' && !strchr(word, ',');
}

/* Reads "read,write,delete" or some of these; cuts the word in place. */
static bool read_rights(char *word, unsigned *out) {
  static const char *const names[] = {"read", "write", "delete"};
  char *rest = NULL;
  unsigned rights = 0;
  for (char *name = strtok_r(word, ",", &rest); name; name = strtok_r(NULL, ",", &rest)) {
    unsigned i = 0;
    while (i < 3 && strcmp(name, names[i]) != 0) i++;
    if (i == 3) return false;
    rights |= 1u << i;
  }
  *out = rights;
  return rights != 0;
}

_Static_assert(API_MAY_READ == 1 && API_MAY_WRITE == 2 && API_MAY_DELETE == 4,
               "read_rights adds them up by place");

static bool read_word(char *word, bool is_last, api_key *key) {
  if (srv_parse_rate(word, &key->rate)) return is_last;
  return read_rights(word, &key->rights);
}

/* Reads KEY, then rights, a rate, or both in this order. */
static bool read_line(char *line, api_key *key) {
  char *rest = NULL;
  *key = (api_key){.text = strtok_r(line, blanks, &rest), .rights = ALL_RIGHTS};
  char *first = strtok_r(NULL, blanks, &rest), *second = strtok_r(NULL, blanks, &rest);
  if (!is_key(key->text) || strtok_r(NULL, blanks, &rest)) return false;
  if (second && !srv_parse_rate(second, &key->rate)) return false;
  return !first || read_word(first, !second, key);
}

/* Parses one trimmed item of a list into a key; false when it is malformed. */
typedef bool read_item(char *item, api_key *key);

static bool read_bare(char *item, api_key *key) {
  *key = (api_key){.text = item, .rights = ALL_RIGHTS};
  return is_key(item);
}

static size_t count_items(const char *text, char separator) {
  size_t count = 1;
  for (; *text != '\0'; text++) count += *text == separator;
  return count;
}

/* Cuts the text into items; skips empty ones and, in files, lines that begin with '#'. Returns the number of
 * the first malformed item, counted from 1, or 0. */
static size_t read_items(srv_key_list *list, bool is_file, read_item *read) {
  char separator = is_file ? '\n' : ',';
  size_t number = 0;
  for (char *at = list->text, *next; at; at = next) {
    next = strchr(at, separator);
    if (next) *next++ = '\0';
    number++;
    char *item = srv_trim(at);
    if (*item == '\0' || (is_file && *item == '#')) continue;
    if (!read(item, &list->keys[list->count++])) return number;
  }
  return 0;
}

/* complaint: error text for a malformed item, after its number. A setting that is given but holds no key is
 * an error: it must not open what it was meant to lock. */
static bool read_list(const char *flag, const char *setting, read_item *read, const char *complaint,
                      srv_key_list *list, srv_error *error) {
  bool is_file = setting[0] == '@';
  if (setting[0] == '\0') return true;
  list->text = srv_config_text(flag, setting, FILE_MAX, error);
  if (!list->text) return false;
  list->keys = calloc(count_items(list->text, is_file ? '\n' : ','), sizeof *list->keys);
  if (!list->keys) return srv_fail(error, "out of memory");
  size_t bad = read_items(list, is_file, read);
  if (bad > 0)
    srv_fail(error, "--%s: %s %zu %s", flag, is_file ? "line" : "item", bad, complaint);
  else if (list->count == 0)
    srv_fail(error, "--%s: there is no key in it", flag);
  return bad == 0 && list->count > 0;
}

static bool read_keys(const srv_config *config, srv_key_list *list, srv_error *error) {
  bool is_file = config->api_keys[0] == '@';
  return read_list("api-keys", config->api_keys, is_file ? read_line : read_bare,
                   is_file ? "is not KEY [RIGHTS] [RATE], as in 's3cret read,write 50/s'"
                           : "has a blank in it; a list has keys alone, rights and rates need @FILE",
                   list, error);
}

bool srv_keyring_read(const srv_config *config, srv_keyring *out, srv_error *error) {
  *out = (srv_keyring){0};
  bool is_read = read_keys(config, &out->keys, error) &&
                 read_list("url-keys", config->url_keys, read_bare,
                           "is not one key: there is a blank or a comma in it", &out->url_keys, error);
  if (!is_read) srv_keyring_deinit(out);
  out->list = (api_keyring){out->keys.keys, out->keys.count, out->url_keys.keys, out->url_keys.count};
  return is_read;
}

static void deinit_list(srv_key_list *list) {
  free(list->text);
  free(list->keys);
}

void srv_keyring_deinit(srv_keyring *keyring) {
  deinit_list(&keyring->keys);
  deinit_list(&keyring->url_keys);
  *keyring = (srv_keyring){0};
}
