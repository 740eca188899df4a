/* Rules of parameters: a table tells of each its name, how it is read into the handler's struct and how it is
 * printed for keys, so that a parameter stands in one line. */
#ifndef API_RULES_H
#define API_RULES_H

#include "call.h"

typedef struct api_rule api_rule;

/* A row of a table, which ends with a row without a name. */
struct api_rule {
  const char *name;
  unsigned keys; /* bits: the keys that it is printed in, see api_rules_print */
  size_t offset; /* of its member in the handler's struct */
  /* Of a choice, its values: const char *const *, NULL-terminated. Of the row that ends a table, where it
   * goes on: const api_rule *. Or NULL. */
  const void *more;
  /* Reads it if the query has it; NULL: another row does, or the handler. */
  api_outcome (*read)(api_call *call, const api_rule *rule, void *out);
  void (*print)(const void *from, const api_rule *rule, tw_text *text); /* NULL: another row does */
};

/* The row itself; where the table ends, the first of those that follow, or NULL. */
static inline const api_rule *api_rule_first(const api_rule *rules) {
  while (!rules->name && rules->more) rules = rules->more;
  return rules->name ? rules : NULL;
}

static inline const api_rule *api_rule_next(const api_rule *rule) {
  return api_rule_first(rule + 1);
}

/* TW_SYNTAX for a parameter that the table has not, with those that it has. exp and sig, which belong to
 * signed URLs, are in all. */
tw_status api_rules_admit(const api_rule *rules, const api_query *query, tw_error *error);

/* Reads all that the query has in the order of the table; the rest of *out stays as it is. 400. */
api_outcome api_rules_read(api_call *call, const api_rule *rules, void *out);

/* Prints the values of the rules that belong to one of the keys, each as "&name=value". */
void api_rules_print(const void *from, const api_rule *rules, unsigned keys, tw_text *text);

/* For rules of members that are uint64_t, bool, and int. A uint64_t is printed in a way of its own. */
api_outcome api_rule_read_count(api_call *call, const api_rule *rule, void *out);
api_outcome api_rule_read_flag(api_call *call, const api_rule *rule, void *out);
api_outcome api_rule_read_choice(api_call *call, const api_rule *rule, void *out);
void api_rule_print_flag(const void *from, const api_rule *rule, tw_text *text);
void api_rule_print_choice(const void *from, const api_rule *rule, tw_text *text);
/* Prints the word of a choice in place of its number. */
void api_rule_print_word(const void *from, const api_rule *rule, tw_text *text);

/* Begins what a rule prints: "name=", after "&" if it is not the first. */
void api_rule_begin(const char *name, tw_text *text);

#endif
