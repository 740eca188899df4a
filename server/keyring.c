/* A list on the command line has keys alone, cut at commas. A file has one key a line, blank lines and
 * comments aside; a line of --api-keys is KEY [RIGHTS] [RATE], and a key without rights may do everything.
 * Errors name lines and items and never show what is in them. */
#include "keyring.h"

#include "disk.h"

#include <stdlib.h>
#include <string.h>

enum { FILE_MAX = 1 << 20 };

static const unsigned ALL_RIGHTS = API_MAY_READ | API_MAY_WRITE | API_MAY_DELETE;
static const char BLANKS[] = " \t\r\n";

static bool is_key(const char *word) {
  return word[strcspn(word, BLANKS)] == '\0' && strchr(word, ',') == NULL;
}

/* "read,write,delete" or fewer of them; cuts the word. */
static bool read_rights(char *word, unsigned *out) {
  static const char *const NAMES[] = {"read", "write", "delete"};
  char *rest = NULL;
  unsigned rights = 0;
  for (char *name = strtok_r(word, ",", &rest); name != NULL; name = strtok_r(NULL, ",", &rest)) {
    unsigned i = 0;
    while (i < 3 && strcmp(name, NAMES[i]) != 0) i++;
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

/* Words behind the key: its rights, its rate, or both in this order. */
static bool read_line(char *line, api_key *key) {
  char *rest = NULL;
  *key = (api_key){.text = strtok_r(line, BLANKS, &rest), .rights = ALL_RIGHTS};
  char *first = strtok_r(NULL, BLANKS, &rest), *second = strtok_r(NULL, BLANKS, &rest);
  if (!is_key(key->text) || strtok_r(NULL, BLANKS, &rest) != NULL) return false;
  if (second != NULL && !srv_parse_rate(second, &key->rate)) return false;
  return first == NULL || read_word(first, second == NULL, key);
}

/* What becomes of an item, which has no blanks around it; false: the item is malformed. */
typedef bool take_item(srv_keyring *keyring, char *item);

static bool take_line(srv_keyring *keyring, char *item) {
  return read_line(item, &keyring->keys[keyring->list.count++]);
}

static bool take_key(srv_keyring *keyring, char *item) {
  keyring->keys[keyring->list.count++] = (api_key){.text = item, .rights = ALL_RIGHTS};
  return is_key(item);
}

static bool take_url_key(srv_keyring *keyring, char *item) {
  keyring->url_keys[keyring->list.url_count++] = item;
  return is_key(item);
}

static size_t count_items(const char *text, char separator) {
  size_t count = 1;
  for (; *text != '\0'; text++) count += *text == separator;
  return count;
}

/* Cuts the text; empty items and, in files, lines that begin with '#' are skipped. Returns the number of the
 * first malformed item, from 1; 0: none is. */
static size_t take_items(srv_keyring *keyring, char *text, bool is_file, take_item *take) {
  char separator = is_file ? '\n' : ',';
  size_t number = 0;
  for (char *at = text, *next; at != NULL; at = next) {
    next = strchr(at, separator);
    if (next != NULL) *next++ = '\0';
    number++;
    char *item = srv_trim(at);
    if (*item == '\0' || (is_file && *item == '#')) continue;
    if (!take(keyring, item)) return number;
  }
  return 0;
}

/* A setting that is given but has no key is an error: it must not open what it was meant to lock. */
static bool check_count(const char *flag, size_t count, char *error, size_t error_size) {
  if (count == 0) snprintf(error, error_size, "--%s: there is no key in it", flag);
  return count > 0;
}

static bool read_keys(const srv_config *config, srv_keyring *keyring, char *error, size_t error_size) {
  const char *setting = config->api_keys;
  if (setting[0] == '\0') return true;
  bool is_file = setting[0] == '@';
  keyring->keys_text = srv_config_text("api-keys", setting, FILE_MAX, error, error_size);
  if (keyring->keys_text == NULL) return false;
  keyring->keys = calloc(count_items(keyring->keys_text, is_file ? '\n' : ','), sizeof *keyring->keys);
  if (keyring->keys == NULL) {
    snprintf(error, error_size, "out of memory");
    return false;
  }
  keyring->list.keys = keyring->keys;
  size_t bad = take_items(keyring, keyring->keys_text, is_file, is_file ? take_line : take_key);
  if (bad == 0) return check_count("api-keys", keyring->list.count, error, error_size);
  if (is_file) {
    snprintf(error, error_size,
             "--api-keys: line %zu is not KEY [RIGHTS] [RATE], as in 's3cret read,write 50/s'", bad);
  } else {
    snprintf(error, error_size,
             "--api-keys: item %zu has a blank in it; a list has keys alone, rights and rates need @FILE",
             bad);
  }
  return false;
}

static bool read_url_keys(const srv_config *config, srv_keyring *keyring, char *error, size_t error_size) {
  const char *setting = config->url_keys;
  if (setting[0] == '\0') return true;
  bool is_file = setting[0] == '@';
  keyring->urls_text = srv_config_text("url-keys", setting, FILE_MAX, error, error_size);
  if (keyring->urls_text == NULL) return false;
  keyring->url_keys =
      calloc(count_items(keyring->urls_text, is_file ? '\n' : ','), sizeof *keyring->url_keys);
  if (keyring->url_keys == NULL) {
    snprintf(error, error_size, "out of memory");
    return false;
  }
  keyring->list.url_keys = keyring->url_keys;
  size_t bad = take_items(keyring, keyring->urls_text, is_file, take_url_key);
  if (bad == 0) return check_count("url-keys", keyring->list.url_count, error, error_size);
  snprintf(error, error_size, "--url-keys: %s %zu is not one key: there is a blank or a comma in it",
           is_file ? "line" : "item", bad);
  return false;
}

bool srv_keyring_read(const srv_config *config, srv_keyring *out, char *error, size_t error_size) {
  *out = (srv_keyring){0};
  if (read_keys(config, out, error, error_size) && read_url_keys(config, out, error, error_size)) return true;
  srv_keyring_deinit(out);
  return false;
}

void srv_keyring_deinit(srv_keyring *keyring) {
  free(keyring->keys_text);
  free(keyring->urls_text);
  free(keyring->keys);
  free(keyring->url_keys);
  *keyring = (srv_keyring){0};
}
