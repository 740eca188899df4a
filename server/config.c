/* One table describes every setting: flag, type, default, range and help. The environment variable's name is
 * derived from the flag's. */
#include "config.h"

#include "api.h"
#include "disk.h"
#include "machine.h"

#include <errno.h>
#include <inttypes.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef enum kind {
  KIND_TEXT, /* char * */
  KIND_SIZE, /* uint64_t, as are the next three */
  KIND_COUNT,
  KIND_DURATION, /* milliseconds */
  KIND_CHOICE,   /* the index of the chosen word */
  KIND_SWITCH,   /* bool */
  KIND_RATE      /* api_rate */
} kind;

typedef struct setting {
  const char *flag;
  kind kind;
  size_t offset;        /* in srv_config */
  const char *fallback; /* the default; NULL: set_defaults computes it */
  uint64_t low, high;
  const char *choices; /* "a|b|c" */
  const char *argument, *help;
} setting;

enum { FLAG_SIZE = 64, LEVEL_FILE_MAX = 64 };

#define AT(field) offsetof(srv_config, field)
#define DAY_MS    UINT64_C(86400000)
#define ANY       UINT64_MAX
#define GIBIBYTE  (UINT64_C(1) << 30)

static const setting known_settings[] = {
    {"listen", KIND_TEXT, AT(listen), "127.0.0.1:8080", 0, 0, NULL, "ADDRESS",
     "the address to serve: ADDRESS:PORT, [::]:PORT, NAME:PORT or unix:PATH; port 0 takes a free port"},
    {"admin-listen", KIND_TEXT, AT(admin_listen), "", 0, 0, NULL, "ADDRESS",
     "a second address for probes, /version and /metrics, without keys and TLS, also when --listen is "
     "overloaded"},
    {"data", KIND_TEXT, AT(data), "./tweend-data", 0, 0, NULL, "PLACE",
     "where models are stored: a folder, which is created if missing, or s3://BUCKET/PREFIX"},
    {"s3-endpoint", KIND_TEXT, AT(s3_endpoint), "", 0, 0, NULL, "URL",
     "URL of the object store, as https://HOST:PORT (default: Amazon's in the region)"},
    {"s3-region", KIND_TEXT, AT(s3_region), "", 0, 0, NULL, "REGION",
     "region of the object store (default: AWS_REGION, AWS_DEFAULT_REGION, else us-east-1)"},
    {"s3-style", KIND_CHOICE, AT(s3_style), "auto", 0, 0, "auto|path|virtual", "STYLE",
     "whether URLs have the bucket in the path or in the host name; auto: in the path with --s3-endpoint"},
    {"s3-credentials", KIND_TEXT, AT(s3_credentials), "", 0, 0, NULL, "FILE",
     "a file in the format of ~/.aws/credentials, read again when it changes (default: AWS_ACCESS_KEY_ID and "
     "AWS_SECRET_ACCESS_KEY, else the file AWS_SHARED_CREDENTIALS_FILE or ~/.aws/credentials)"},
    {"s3-timeout", KIND_DURATION, AT(s3_timeout), "60s", 1, DAY_MS, NULL, "DURATION",
     "time to read a model from the object store, or to store it there"},
    {"cache-dir", KIND_TEXT, AT(cache_dir), "./tweend-cache", 0, 0, NULL, "FOLDER",
     "with s3://, the folder for copies of models and for long uploads in progress"},
    {"cache-size", KIND_SIZE, AT(cache_size), "1GiB", 0, UINT64_C(1) << 60, NULL, "SIZE",
     "disk space for the copies in --cache-dir"},
    {"store-limit", KIND_SIZE, AT(store_limit), "0", 0, UINT64_C(1) << 60, NULL, "SIZE",
     "total bytes of stored models; further uploads are answered 507; 0: no limit"},
    {"min-free", KIND_SIZE, AT(min_free), NULL, 0, UINT64_C(1) << 60, NULL, "SIZE",
     "disk space that stays free beside the stored models; uploads, and other bodies that are kept on disk "
     "while they arrive, are answered 507 below it (default: 1GiB, or 5% of a smaller file system)"},
    {"spool-limit", KIND_SIZE, AT(spool_limit), "0", 0, UINT64_C(1) << 60, NULL, "SIZE",
     "total bytes on disk of request bodies in progress; further bodies are answered 503; at least "
     "--max-upload, or 0: no limit"},
    {"threads", KIND_COUNT, AT(threads), NULL, 1, 1024, NULL, "COUNT",
     "compute threads (default: one for each processor that affinity and cgroups allow)"},
    {"io-threads", KIND_COUNT, AT(io_threads), NULL, 1, 1024, NULL, "COUNT",
     "socket threads (default: one for each processor that affinity and cgroups allow)"},
    {"queue", KIND_COUNT, AT(queue), NULL, 0, 1000000, NULL, "COUNT",
     "heavy requests that may wait; further ones are answered 503 (default: 4 for each compute thread)"},
    {"max-connections", KIND_COUNT, AT(max_connections), "1024", 1, 1000000, NULL, "COUNT",
     "open connections; further ones are answered 503, except health checks"},
    {"max-connections-per-address", KIND_COUNT, AT(max_connections_per_address), "0", 0, 1000000, NULL,
     "COUNT", "open connections of one address (with IPv6, of one /64); 0: no limit"},
    {"rate-limit", KIND_RATE, AT(rate_limit), "", 0, 0, NULL, "RATE",
     "requests of one address, as 50/s, 100/m or 1000/h; further ones are answered 429; empty: no limit"},
    {"trusted-proxies", KIND_TEXT, AT(trusted_proxies), "", 0, 0, NULL, "NETWORKS",
     "proxies whose X-Forwarded-For is believed, separated by commas: networks as 10.0.0.0/8, or unix"},
    {"max-listeners", KIND_COUNT, AT(max_listeners), "1000", 0, 1000000, NULL, "COUNT",
     "live streams; further ones are answered 503"},
    {"max-upload", KIND_SIZE, AT(max_upload), "256MiB", 1, UINT64_C(1) << 40, NULL, "SIZE",
     "longest request body, before and after decoding"},
    {"max-level", KIND_COUNT, AT(max_level), "10", 0, 16, NULL, "COUNT", "deepest subdivision level"},
    {"max-faces", KIND_COUNT, AT(max_faces), "80M", 1, UINT64_C(1) << 40, NULL, "COUNT",
     "most faces of one surface"},
    {"max-output", KIND_SIZE, AT(max_output), "4GiB", 1, UINT64_C(1) << 50, NULL, "SIZE", "longest answer"},
    {"max-times", KIND_COUNT, AT(max_times), "1M", 1, UINT64_C(1) << 40, NULL, "COUNT",
     "most times of one pose request"},
    {"plan-cache", KIND_SIZE, AT(plan_cache), "256MiB", 0, UINT64_C(1) << 50, NULL, "SIZE",
     "memory for models, plans and small answers that are kept between requests"},
    {"max-memory", KIND_SIZE, AT(max_memory), NULL, UINT64_C(16) << 20, UINT64_C(1) << 50, NULL, "SIZE",
     "memory of all requests, live streams and caches; a request waits for memory and is answered 503 if "
     "that takes too long, 422 if it needs more than all of it (default: 1GiB, or 3/4 of the cgroup's "
     "limit)"},
    {"header-timeout", KIND_DURATION, AT(header_timeout), "10s", 1, DAY_MS, NULL, "DURATION",
     "time for a request's headers to arrive"},
    {"idle-timeout", KIND_DURATION, AT(idle_timeout), "60s", 1, DAY_MS, NULL, "DURATION",
     "time between two requests on a connection"},
    {"request-timeout", KIND_DURATION, AT(request_timeout), "120s", 1, DAY_MS, NULL, "DURATION",
     "time from a request's headers to the end of its body, and in the queue"},
    {"compute-timeout", KIND_DURATION, AT(compute_timeout), "30s", 0, DAY_MS, NULL, "DURATION",
     "time to compute one answer, without the client's; then 503, or the "
     "answer is cut off; 0: no limit"},
    {"drain-timeout", KIND_DURATION, AT(drain_timeout), "20s", 0, DAY_MS, NULL, "DURATION",
     "time after SIGTERM to finish requests and to let clients receive all of their answers"},
    {"drain-delay", KIND_DURATION, AT(drain_delay), "0", 0, DAY_MS, NULL, "DURATION",
     "time after SIGTERM before the drain: /readyz answers 503 already, all else goes on"},
    {"min-rate", KIND_SIZE, AT(min_rate), "4KiB", 0, UINT64_C(1) << 40, NULL, "SIZE",
     "bytes a second; slower clients are cut off while they send or receive"},
    {"api-keys", KIND_TEXT, AT(api_keys), "", 0, 0, NULL, "KEYS",
     "keys separated by commas, each with all rights; or @FILE with a line KEY [RIGHTS] [RATE] for each, as "
     "'s3cret read,write,delete 50/s' (no rights: all; # starts a comment); empty: no key needed"},
    {"url-keys", KIND_TEXT, AT(url_keys), "", 0, 0, NULL, "KEYS",
     "keys that sign URLs, separated by commas; or @FILE with one in each line; POST /v1/sign uses the "
     "first"},
    {"cors-origins", KIND_TEXT, AT(cors_origins), "*", 0, 0, NULL, "ORIGINS",
     "origins of web pages, separated by commas; * for all, empty for none"},
    {"hosts", KIND_TEXT, AT(hosts), "", 0, 0, NULL, "HOSTS",
     "on a loopback address without API keys, hosts that are served besides localhost, 127.0.0.1 and [::1], "
     "separated by commas and without ports; * for all; others are answered 421"},
    {"tls-cert", KIND_TEXT, AT(tls_cert), "", 0, 0, NULL, "FILE",
     "certificate chain (PEM); with --tls-key, serves https"},
    {"tls-key", KIND_TEXT, AT(tls_key), "", 0, 0, NULL, "FILE", "private key (PEM)"},
    {"log-level", KIND_TEXT, AT(log_level), "info", 0, 0, NULL, "LEVEL",
     "error, warn, info (a line for each request), debug, or @FILE that holds one of these"},
    {"log-format", KIND_CHOICE, AT(log_format), "auto", 0, 0, "auto|text|json", "FORMAT",
     "text, json, or auto: text on a terminal, else json"},
    {"sample", KIND_SWITCH, AT(sample), "false", 0, 0, NULL, NULL, "store the sample models at start"},
    {"check", KIND_SWITCH, AT(check), "false", 0, 0, NULL, NULL,
     "check whether the daemon would start with these settings; exit with 0 or 1"},
    {"healthcheck", KIND_SWITCH, AT(healthcheck), "false", 0, 0, NULL, NULL,
     "ask the running daemon for /readyz; exit with 0 or 1"},
};
static const size_t SETTING_COUNT = sizeof known_settings / sizeof *known_settings;

/* ---- quantities ------------------------------------------------------------------------------ */

typedef struct unit {
  const char *name;
  uint64_t factor;
} unit;

static const unit size_units[] = {
    {"", 1},
    {"B", 1},
    {"KiB", UINT64_C(1) << 10},
    {"MiB", UINT64_C(1) << 20},
    {"GiB", UINT64_C(1) << 30},
    {"TiB", UINT64_C(1) << 40},
    {"kB", 1000},
    {"MB", 1000000},
    {"GB", 1000000000},
    {"TB", UINT64_C(1000000000000)},
};
static const unit count_units[] = {{"", 1}, {"k", 1000}, {"M", 1000000}, {"G", 1000000000}};
static const unit duration_units[] = {{"ms", 1}, {"s", 1000}, {"m", 60000}, {"h", 3600000}};

/* Returns the text after the digits, NULL when there are none or the number overflows. */
static const char *read_digits(const char *text, uint64_t *out) {
  const char *at = text;
  uint64_t number = 0;
  for (; *at >= '0' && *at <= '9'; at++) {
    uint64_t digit = (uint64_t)(*at - '0');
    if (number > (UINT64_MAX - digit) / 10) return NULL;
    number = number * 10 + digit;
  }
  if (at == text) return NULL;
  *out = number;
  return at;
}

static bool read_quantity(const char *text, const unit *units, size_t unit_count, uint64_t *out) {
  uint64_t number;
  const char *name = read_digits(text, &number);
  if (!name) return false;
  for (size_t i = 0; i < unit_count; i++) {
    if (strcmp(name, units[i].name) != 0) continue;
    if (number > UINT64_MAX / units[i].factor) return false;
    *out = number * units[i].factor;
    return true;
  }
  return false;
}

bool srv_parse_size(const char *text, uint64_t *out) {
  return read_quantity(text, size_units, sizeof size_units / sizeof *size_units, out);
}

bool srv_parse_count(const char *text, uint64_t *out) {
  return read_quantity(text, count_units, sizeof count_units / sizeof *count_units, out);
}

bool srv_parse_duration(const char *text, uint64_t *out) {
  if (strcmp(text, "0") == 0) {
    *out = 0;
    return true;
  }
  return read_quantity(text, duration_units, sizeof duration_units / sizeof *duration_units, out);
}

bool srv_parse_rate(const char *text, api_rate *out) {
  static const char unit_letters[] = "smh";
  static const uint32_t seconds[] = {1, 60, 3600};
  uint64_t number;
  const char *unit = read_digits(text, &number);
  if (!unit || number == 0 || number > SRV_RATE_MAX) return false;
  const char *found =
      unit[0] == '/' && unit[1] != '\0' && unit[2] == '\0' ? strchr(unit_letters, unit[1]) : NULL;
  if (!found) return false;
  *out = (api_rate){(uint32_t)number, seconds[found - unit_letters]};
  return true;
}

/* ---- flags and variables --------------------------------------------------------------------- */

static void variable_name(const char *flag, char name[FLAG_SIZE]) {
  int size = snprintf(name, FLAG_SIZE, "TWEEND_%s", flag);
  for (int i = 0; i < size && i < FLAG_SIZE - 1; i++) {
    if (name[i] == '-') name[i] = '_';
    if (name[i] >= 'a' && name[i] <= 'z') name[i] = (char)(name[i] - 'a' + 'A');
  }
}

/* ---- --help and the manual page -------------------------------------------------------------- */

typedef struct section {
  const char *title, *text; /* lines of at most 100 characters */
} section;

static const char purpose[] = "subdivision surfaces and rotation tracks over HTTP";

static const section sections[] = {
    {"Signals",
     "SIGHUP reads the files of --api-keys, --url-keys, --log-level, --tls-cert and --tls-key again. "
     "SIGTERM,\n"
     "SIGINT and SIGQUIT finish the running requests and end the daemon; a second one ends it at once."},
    {"Limits",
     "A request's target has at most 8 KiB and 32 arguments; its head 16 KiB, 64 fields and cookies, and\n"
     "4 KiB of cookies."},
    {"systemd",
     "Sockets passed by systemd are served instead of --listen, those with FileDescriptorName=admin instead\n"
     "of --admin-listen. The daemon tells systemd when it is ready, when it reads files again and when it\n"
     "stops, and tells the watchdog that all socket threads are alive."},
    {"Exit status",
     "0 after a requested end; 1 when the daemon cannot start, or when --check or --healthcheck fail; 2 for\n"
     "a wrong flag or value."},
};
enum { SECTION_COUNT = sizeof sections / sizeof *sections };

/* Flags that print something and exit; they are no settings. */
static const section printing[] = {
    {"-h, --help", "this text"},
    {"--man", "the same as a manual page"},
    {"--version", "the version"},
};
enum { PRINTING_COUNT = sizeof printing / sizeof *printing };

static bool tells_fallback(const setting *s) {
  return s->fallback && s->fallback[0] != '\0' && s->kind != KIND_SWITCH;
}

static void print_help(FILE *out) {
  fprintf(out,
          "Usage: tweend [flags]\n\n"
          "tweend: %s. The variable beside a flag is an\n"
          "environment variable with the same meaning; flags win.\n\n",
          purpose);
  for (size_t i = 0; i < SETTING_COUNT; i++) {
    const setting *s = &known_settings[i];
    char variable[FLAG_SIZE];
    variable_name(s->flag, variable);
    fprintf(out, "  --%s%s%s  (%s)\n      %s", s->flag, s->argument ? " " : "",
            s->argument ? s->argument : "", variable, s->help);
    if (tells_fallback(s)) fprintf(out, " (default: %s)", s->fallback);
    fputc('\n', out);
  }
  for (size_t i = 0; i < PRINTING_COUNT; i++)
    fprintf(out, "  %s\n      %s\n", printing[i].title, printing[i].text);
  for (size_t i = 0; i < SECTION_COUNT; i++) fprintf(out, "\n%s:\n%s\n", sections[i].title, sections[i].text);
}

/* Escapes what roff would interpret. */
static void print_roff(FILE *out, const char *text) {
  for (const char *at = text; *at != '\0'; at++) {
    bool begins = at == text || at[-1] == '\n';
    if (begins && (*at == '.' || *at == '\'')) fputs("\\&", out);
    if (*at == '-')
      fputs("\\-", out);
    else if (*at == '\\')
      fputs("\\e", out);
    else
      fputc(*at, out);
  }
}

static void print_manual(FILE *out) {
  fputs(".TH TWEEND 1 \"\" \"tweend " TWEEND_VERSION "\"\n.SH NAME\ntweend \\- ", out);
  fprintf(out, "%s\n.SH SYNOPSIS\n.B tweend\n.RI [ flags ]\n.SH OPTIONS\n", purpose);
  fputs("The variable beside a flag is an environment variable with the same meaning; flags win.\n", out);
  for (size_t i = 0; i < SETTING_COUNT; i++) {
    const setting *s = &known_settings[i];
    char variable[FLAG_SIZE];
    variable_name(s->flag, variable);
    fputs(".TP\n\\fB\\-\\-", out);
    print_roff(out, s->flag);
    fputs("\\fR", out);
    if (s->argument) fprintf(out, " \\fI%s\\fR", s->argument);
    fprintf(out, " (\\fB%s\\fR)\n", variable);
    print_roff(out, s->help);
    if (tells_fallback(s)) fputs(" (default: ", out), print_roff(out, s->fallback), fputs(")", out);
    fputc('\n', out);
  }
  for (size_t i = 0; i < PRINTING_COUNT; i++) {
    fputs(".TP\n.B ", out);
    print_roff(out, printing[i].title);
    fprintf(out, "\n%s\n", printing[i].text);
  }
  for (size_t i = 0; i < SECTION_COUNT; i++) {
    fprintf(out, ".SH %s\n", sections[i].title);
    print_roff(out, sections[i].text);
    fputc('\n', out);
  }
}

static bool parse_choice(const char *choices, const char *text, uint64_t *out) {
  size_t size = strlen(text);
  uint64_t index = 0;
  for (const char *at = choices; size > 0; index++) {
    size_t choice_size = strcspn(at, "|");
    if (choice_size == size && memcmp(at, text, size) == 0) {
      *out = index;
      return true;
    }
    if (at[choice_size] == '\0') return false;
    at += choice_size + 1;
  }
  return false;
}

static bool parse_switch(const char *text, bool *out) {
  uint64_t word;
  *out = parse_choice("true|1|yes|on", text, &word);
  return *out || text[0] == '\0' || parse_choice("false|0|no|off", text, &word);
}

static bool parse_number(const setting *s, const char *text, uint64_t *out) {
  uint64_t number = 0;
  bool parsed = false;
  switch (s->kind) {
  case KIND_SIZE: parsed = srv_parse_size(text, &number); break;
  case KIND_COUNT: parsed = srv_parse_count(text, &number); break;
  case KIND_DURATION: parsed = srv_parse_duration(text, &number); break;
  case KIND_CHOICE: return parse_choice(s->choices, text, out);
  case KIND_TEXT:
  case KIND_RATE:
  case KIND_SWITCH: return false;
  }
  if (!parsed || number < s->low || number > s->high) return false;
  *out = number;
  return true;
}

static const char *expected(const setting *s) {
  switch (s->kind) {
  case KIND_SIZE: return "a size such as 256MiB";
  case KIND_COUNT: return "a count such as 8 or 80M";
  case KIND_DURATION: return "a duration such as 500ms or 10s";
  case KIND_CHOICE: return s->choices;
  case KIND_SWITCH: return "true or false";
  case KIND_RATE: return "a rate such as 50/s, 100/m or 1000/h, of at most 1000000000";
  case KIND_TEXT: break;
  }
  return "";
}

static bool assign(srv_config *config, const setting *s, const char *text) {
  char *base = (char *)config + s->offset;
  if (s->kind == KIND_TEXT) {
    char *copy = strdup(text);
    if (!copy) return false;
    free(*(char **)(void *)base);
    *(char **)(void *)base = copy;
    return true;
  }
  if (s->kind == KIND_SWITCH) return parse_switch(text, (bool *)base);
  if (s->kind == KIND_RATE) {
    api_rate *rate = (api_rate *)(void *)base;
    *rate = (api_rate){0};
    return text[0] == '\0' || srv_parse_rate(text, rate);
  }
  return parse_number(s, text, (uint64_t *)(void *)base);
}

static bool fail_value(const setting *s, const char *source, const char *text, srv_error *error) {
  char range[80] = "";
  if (s->kind == KIND_TEXT) return srv_fail(error, "%s: out of memory", source); /* any text is one */
  if (s->kind == KIND_SIZE || s->kind == KIND_COUNT || s->kind == KIND_DURATION)
    snprintf(range, sizeof range, " from %" PRIu64 " to %" PRIu64 "%s", s->low, s->high,
             s->kind == KIND_DURATION ? " ms" : "");
  return srv_fail(error, "%s: '%s' is not %s%s", source, text, expected(s), range);
}

static bool read_environment(srv_config *config, char *(*environment)(const char *name), srv_error *error) {
  for (size_t i = 0; i < SETTING_COUNT; i++) {
    char variable[FLAG_SIZE];
    variable_name(known_settings[i].flag, variable);
    const char *text = environment(variable);
    if (text && !assign(config, &known_settings[i], text))
      return fail_value(&known_settings[i], variable, text, error);
  }
  return true;
}

static const setting *find_setting(const char *name, size_t size) {
  for (size_t i = 0; i < SETTING_COUNT; i++) {
    if (strlen(known_settings[i].flag) == size && memcmp(known_settings[i].flag, name, size) == 0)
      return &known_settings[i];
  }
  return NULL;
}

static const char *nearest(const char *name, size_t size) {
  const setting *best = &known_settings[0];
  for (size_t i = 1; i < SETTING_COUNT; i++)
    if (api_name_distance(name, size, known_settings[i].flag) < api_name_distance(name, size, best->flag))
      best = &known_settings[i];
  return best->flag;
}

void srv_config_warn(char *const *environment) {
  static const char prefix[] = "TWEEND_";
  for (; *environment; environment++) {
    if (strncmp(*environment, prefix, sizeof prefix - 1) != 0) continue;
    const char *name = *environment + sizeof prefix - 1;
    size_t size = strcspn(name, "=");
    char flag[FLAG_SIZE] = "", variable[FLAG_SIZE];
    for (size_t i = 0; i < size && i < FLAG_SIZE - 1; i++)
      flag[i] = (char)(name[i] == '_'                     ? '-'
                       : name[i] >= 'A' && name[i] <= 'Z' ? name[i] + ('a' - 'A')
                                                          : name[i]);
    const setting *s = find_setting(flag, strlen(flag));
    variable_name(s ? s->flag : nearest(flag, strlen(flag)), variable);
    if (!s || strncmp(variable, *environment, strlen(variable)) != 0)
      srv_log(SRV_LOG_WARN, "the variable %.*s is no setting; the nearest is %s",
              (int)(size + sizeof prefix - 1), *environment, variable);
  }
}

/* Reads the flag argv[*at] and, when its value is a separate argument, advances *at to it. */
static bool read_flag(srv_config *config, int argc, char *const *argv, int *at, srv_error *error) {
  const char *argument = argv[*at];
  size_t name_size = strncmp(argument, "--", 2) == 0 ? strcspn(argument + 2, "=") : 0;
  const setting *s = name_size > 0 ? find_setting(argument + 2, name_size) : NULL;
  if (!s) {
    const char *near = name_size > 0 ? nearest(argument + 2, name_size) : NULL;
    return srv_fail(error, "unknown argument '%s'%s%s; see --help", argument, near ? ", nearest: --" : "",
                    near ? near : "");
  }
  const char *value = argument + 2 + name_size;
  if (*value == '=') {
    value++;
  } else if (s->kind == KIND_SWITCH) {
    value = "true";
  } else if (++*at < argc) {
    value = argv[*at];
  } else {
    return srv_fail(error, "--%s needs a value", s->flag);
  }
  if (assign(config, s, value)) return true;
  char source[FLAG_SIZE];
  snprintf(source, sizeof source, "--%s", s->flag);
  return fail_value(s, source, value, error);
}

static bool set_defaults(srv_config *config) {
  for (size_t i = 0; i < SETTING_COUNT; i++) {
    if (known_settings[i].fallback && !assign(config, &known_settings[i], known_settings[i].fallback))
      return false;
  }
  /* Defaults that depend on the machine. check_together sets the queue once the number of threads is
   * known. */
  uint64_t cpus = srv_machine_cpus("");
  config->threads = cpus > 1024 ? 1024 : cpus;
  config->io_threads = config->threads;
  config->queue = ANY;
  config->min_free = SRV_MIN_FREE_AUTO;
  uint64_t limit = srv_machine_memory_limit("");
  config->max_memory = limit < UINT64_MAX && limit / 4 * 3 < GIBIBYTE ? limit / 4 * 3 : GIBIBYTE;
  return true;
}

/* ---- settings that may name a file ----------------------------------------------------------- */

char *srv_config_text(const char *flag, const char *setting, size_t size_max, srv_error *error) {
  bool is_file = setting[0] == '@';
  char *text = is_file ? srv_read_text(setting + 1, size_max) : strdup(setting);
  if (!text && is_file)
    srv_fail(error, "--%s: cannot read '%s': %s", flag, setting + 1, strerror(errno));
  else if (!text)
    srv_fail(error, "--%s: out of memory", flag);
  return text;
}

bool srv_config_log_level(const srv_config *config, srv_log_level *out, srv_error *error) {
  static const char levels[] = "error|warn|info|debug";
  char *text = srv_config_text("log-level", config->log_level, LEVEL_FILE_MAX, error);
  if (!text) return false;
  const char *word = srv_trim(text);
  uint64_t level = 0;
  bool is_level =
      parse_choice(levels, word, &level) || srv_fail(error, "--log-level: '%s' is not %s", word, levels);
  if (is_level) *out = (srv_log_level)level;
  free(text);
  return is_level;
}

bool srv_config_is_s3(const srv_config *config) {
  return strncmp(config->data, "s3://", 5) == 0;
}

/* Whether the text is an origin as browsers send it: scheme and host without a path, or "null", the origin of
 * pages from files and sandboxes. */
static bool is_origin(const char *text, size_t size) {
  const char *host = strstr(text, "://");
  if (!host || host >= text + size) return size == strlen("null") && strncmp(text, "null", size) == 0;
  size_t before = (size_t)(host - text) + strlen("://");
  return host > text && before < size && !memchr(text + before, '/', size - before);
}

static const char separators[] = ", \t"; /* the items of a list */

static bool check_origins(const char *list, srv_error *error) {
  for (list += strspn(list, separators); *list != '\0'; list += strspn(list, separators)) {
    size_t size = strcspn(list, separators);
    if (!(size == 1 && *list == '*') && !is_origin(list, size))
      return srv_fail(error, "--cors-origins: '%.*s' is not * or an origin such as https://example.org",
                      (int)size, list);
    list += size;
  }
  return true;
}

/* Whether the text can be compared with the host of a request: no scheme, no port, no path. */
static bool is_host(const char *text, size_t size) {
  static const char name_characters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_";
  bool is_address = size > 2 && text[0] == '[' && text[size - 1] == ']';
  return is_address ? strspn(text + 1, "0123456789abcdefABCDEF:.") == size - 2
                    : strspn(text, name_characters) >= size;
}

static bool check_hosts(const char *list, srv_error *error) {
  for (list += strspn(list, separators); *list != '\0'; list += strspn(list, separators)) {
    size_t size = strcspn(list, separators);
    if (!(size == 1 && *list == '*') && !is_host(list, size))
      return srv_fail(error,
                      "--hosts: '%.*s' is not * or a host such as tweend.example or [fd00::1], without port",
                      (int)size, list);
    list += size;
  }
  return true;
}

static bool check_together(srv_config *config, srv_error *error) {
  if (config->queue == ANY) config->queue = 4 * config->threads;
  if ((config->tls_cert[0] == '\0') != (config->tls_key[0] == '\0'))
    return srv_fail(error, "--tls-cert and --tls-key go together");
#ifndef TWEEND_S3
  if (srv_config_is_s3(config))
    return srv_fail(error, "--data: '%s': this tweend is built without object stores, name a folder",
                    config->data);
#endif
  if (srv_config_is_s3(config) && config->store_limit > 0)
    return srv_fail(error, "--store-limit: an object store has quotas of its own");
  if (srv_config_is_s3(config) && config->cache_dir[0] == '\0')
    return srv_fail(error, "--cache-dir: the folder has no name");
  if (config->data[0] == '\0') return srv_fail(error, "--data: the folder has no name");
  if (config->spool_limit > 0 && config->spool_limit < config->max_upload)
    return srv_fail(error, "--spool-limit is less than --max-upload, the longest body");
  srv_log_level level;
  return check_origins(config->cors_origins, error) && check_hosts(config->hosts, error) &&
         srv_config_log_level(config, &level, error);
}

srv_config_status srv_config_read(srv_config *config, int argc, char *const *argv,
                                  char *(*environment)(const char *name), FILE *out, srv_error *error) {
  *config = (srv_config){0};
  srv_fail(error, "out of memory");
  for (int i = 1; i < argc; i++) {
    if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
      print_help(out);
      return SRV_CONFIG_DONE;
    }
    if (strcmp(argv[i], "--man") == 0) {
      print_manual(out);
      return SRV_CONFIG_DONE;
    }
    if (strcmp(argv[i], "--version") == 0) {
      fputs("tweend " TWEEND_VERSION "\n", out);
      return SRV_CONFIG_DONE;
    }
  }
  if (!set_defaults(config) || !read_environment(config, environment, error)) {
    return SRV_CONFIG_BAD;
  }
  for (int i = 1; i < argc; i++) {
    if (!read_flag(config, argc, argv, &i, error)) return SRV_CONFIG_BAD;
  }
  return check_together(config, error) ? SRV_CONFIG_RUN : SRV_CONFIG_BAD;
}

void srv_config_deinit(srv_config *config) {
  for (size_t i = 0; i < SETTING_COUNT; i++)
    if (known_settings[i].kind == KIND_TEXT)
      free(*(char **)(void *)((char *)config + known_settings[i].offset));
  *config = (srv_config){0};
}
