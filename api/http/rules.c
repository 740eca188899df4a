/* Reads and prints parameters by tables of rules. */
#include "rules.h"

#include <string.h>

#include "near_names.h"
#include "tweend/json_print.h"

static tw_status fail_unknown(const char *name, const api_rule *known, tw_error *error) {
  enum { NAMES_MAX = 63 };
  const char *names[NAMES_MAX + 1] = {NULL};
  char list[220];
  size_t count = 0;
  for (const api_rule *rule = api_rule_first(known); rule && count < NAMES_MAX; rule = api_rule_next(rule))
    names[count++] = rule->name;
  tw_names_join(names, list, sizeof list);
  if (!list[0]) return tw_fail(error, TW_SYNTAX, "unknown parameter \"%.60s\": none is known here", name);
  return tw_fail(error, TW_SYNTAX, "unknown parameter \"%.60s\";%s known: %s", name,
                 api_near_of(name, names).text, list);
}

/* exp and sig belong to signed URLs (signed_url.h) and are allowed on every route. */
static bool is_known(const char *name, const api_rule *known) {
  if (strcmp(name, "exp") == 0 || strcmp(name, "sig") == 0) return true;
  for (const api_rule *rule = api_rule_first(known); rule; rule = api_rule_next(rule))
    if (strcmp(name, rule->name) == 0) return true;
  return false;
}

tw_status api_rules_admit(const api_rule *rules, const api_query *query, tw_error *error) {
  for (size_t i = 0; i < query->count; i++)
    if (!is_known(query->parameters[i].name, rules))
      return fail_unknown(query->parameters[i].name, rules, error);
  return TW_OK;
}

api_outcome api_rules_read(api_call *call, const api_rule *rules, void *out) {
  api_outcome outcome = API_DONE;
  for (const api_rule *rule = api_rule_first(rules); rule && outcome == API_DONE; rule = api_rule_next(rule))
    if (rule->read) outcome = rule->read(call, rule, out);
  return outcome;
}

void api_rules_print(const void *from, const api_rule *rules, unsigned keys, tw_text *text) {
  for (const api_rule *rule = api_rule_first(rules); rule; rule = api_rule_next(rule))
    if (rule->print && (rule->keys & keys)) rule->print(from, rule, text);
}

/* ---- values ---------------------------------------------------------------------------------- */

static void *member(void *out, const api_rule *rule) {
  return (char *)out + rule->offset;
}

static const void *value(const void *from, const api_rule *rule) {
  return (const char *)from + rule->offset;
}

api_outcome api_rule_read_count(api_call *call, const api_rule *rule, void *out) {
  return api_outcome_of(call,
                        api_query_count(&call->query, rule->name, member(out, rule), &call->fault.error));
}

api_outcome api_rule_read_flag(api_call *call, const api_rule *rule, void *out) {
  return api_outcome_of(call,
                        api_query_flag(&call->query, rule->name, member(out, rule), &call->fault.error));
}

api_outcome api_rule_read_choice(api_call *call, const api_rule *rule, void *out) {
  return api_outcome_of(
      call, api_query_choice(&call->query, rule->name, rule->more, member(out, rule), &call->fault.error));
}

void api_rule_begin(const char *name, tw_text *text) {
  tw_text_add(text, text->size > 0 ? "&" : "");
  tw_text_add(text, name);
  tw_text_add(text, "=");
}

void api_rule_print_flag(const void *from, const api_rule *rule, tw_text *text) {
  api_rule_begin(rule->name, text);
  tw_text_count(text, *(const bool *)value(from, rule));
}

void api_rule_print_choice(const void *from, const api_rule *rule, tw_text *text) {
  api_rule_begin(rule->name, text);
  tw_text_integer(text, *(const int *)value(from, rule));
}

void api_rule_print_word(const void *from, const api_rule *rule, tw_text *text) {
  api_rule_begin(rule->name, text);
  tw_text_add(text, ((const char *const *)rule->more)[*(const int *)value(from, rule)]);
}
