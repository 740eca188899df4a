/* A list on the command line bears keys alone, which may do everything; a file has a line for each key:
 * KEY [RIGHTS] [RATE]. Errors name lines and never show what is in them. */
#include "keyring.h"

#include <stdlib.h>
#include <string.h>

enum { FILE_MAX = 1 << 20, RATE_MAX = 1000000000 };

static const unsigned ALL_RIGHTS = API_MAY_READ | API_MAY_WRITE | API_MAY_DELETE;
static const char BLANKS[] = " \t\r";
static const char SEPARATORS[] = ", \t\r\n";

static size_t count_pieces(const char *text, const char *separators) {
  size_t count = 0;
  for (text += strspn(text, separators); *text != '\0'; text += strspn(text, separators), count++)
    text += strcspn(text, separators);
  return count;
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
  if (strchr(key->text, ',') != NULL || strtok_r(NULL, BLANKS, &rest) != NULL) return false;
  if (second != NULL && !srv_parse_rate(second, &key->rate)) return false;
  return first == NULL || read_word(first, second == NULL, key);
}

/* Lines that are blank or begin with '#' bear no key. */
static bool read_file(srv_keyring *keyring, char *error, size_t error_size) {
  size_t number = 0;
  for (char *line = keyring->keys_text; line != NULL;) {
    char *next = strchr(line, '\n');
    if (next != NULL) *next++ = '\0';
    number++;
    line += strspn(line, BLANKS);
    if (*line != '\0' && *line != '#' && !read_line(line, &keyring->keys[keyring->list.count++])) {
      snprintf(error, error_size,
               "--api-keys: line %zu is not KEY [RIGHTS] [RATE], as in 's3cret read,write 50/s'", number);
      return false;
    }
    line = next;
  }
  return true;
}

static void read_list(srv_keyring *keyring) {
  char *rest = NULL;
  for (char *word = strtok_r(keyring->keys_text, SEPARATORS, &rest); word != NULL;
       word = strtok_r(NULL, SEPARATORS, &rest))
    keyring->keys[keyring->list.count++] = (api_key){.text = word, .rights = ALL_RIGHTS};
}

/* Whether a setting that somebody gave bears a key: an empty list must not open the door that it was meant to
 * lock. */
static bool check_count(const char *flag, size_t count, char *error, size_t error_size) {
  if (count == 0) snprintf(error, error_size, "--%s: there is no key in it", flag);
  return count > 0;
}

static bool read_keys(const srv_config *config, srv_keyring *keyring, char *error, size_t error_size) {
  const char *setting = config->api_keys;
  if (setting[0] == '\0') return true;
  keyring->keys_text = srv_config_text("api-keys", setting, FILE_MAX, error, error_size);
  if (keyring->keys_text == NULL) return false;
  bool is_file = setting[0] == '@';
  size_t count = count_pieces(keyring->keys_text, is_file ? "\n" : SEPARATORS);
  keyring->keys = calloc(count + 1, sizeof *keyring->keys);
  if (keyring->keys == NULL) {
    snprintf(error, error_size, "out of memory");
    return false;
  }
  if (!is_file) read_list(keyring);
  if (is_file && !read_file(keyring, error, error_size)) return false;
  keyring->list.keys = keyring->keys;
  return check_count("api-keys", keyring->list.count, error, error_size);
}

static bool read_url_keys(const srv_config *config, srv_keyring *keyring, char *error, size_t error_size) {
  const char *setting = config->url_keys;
  if (setting[0] == '\0') return true;
  keyring->urls_text = srv_config_text("url-keys", setting, FILE_MAX, error, error_size);
  if (keyring->urls_text == NULL) return false;
  keyring->url_keys = calloc(count_pieces(keyring->urls_text, SEPARATORS) + 1, sizeof *keyring->url_keys);
  if (keyring->url_keys == NULL) {
    snprintf(error, error_size, "out of memory");
    return false;
  }
  char *rest = NULL;
  for (char *word = strtok_r(keyring->urls_text, SEPARATORS, &rest); word != NULL;
       word = strtok_r(NULL, SEPARATORS, &rest))
    keyring->url_keys[keyring->list.url_count++] = word;
  keyring->list.url_keys = keyring->url_keys;
  return check_count("url-keys", keyring->list.url_count, error, error_size);
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
