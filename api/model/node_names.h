/* Names of a model's nodes: printed, and suggested for one that no node has. */
#ifndef API_NODE_NAMES_H
#define API_NODE_NAMES_H

#include "near_names.h"
#include "tweend/json_print.h"
#include "tweend/model.h"

/* Prints a member that is a node's name, or null for TW_NO_INDEX. */
void api_node_name_member(tw_text *text, const char *name, const tw_model *model, uint32_t node);

/* Prints the names of nodes as a JSON array. nodes: [count]; NULL for the first `count` nodes. */
void api_node_names_print(const tw_model *model, const uint32_t *nodes, uint32_t count, tw_text *text);

/* The names of nodes that a client may have meant, as api_near_print tells them behind "; ". name: [length],
 * not terminated. */
api_near_sentence api_node_names_near(const tw_model *model, const char *name, size_t length);

/* For each node of `from` the node of `to` that goes by its name: of several of one name the one at the same
 * place among these, or, where `to` has not so many, the first one; TW_NO_INDEX where it has none. [nodes of
 * from] in the arena; NULL without memory. O(nodes log nodes). */
uint32_t *api_nodes_by_name(const tw_model *from, const tw_model *to, tw_arena *arena);

#endif
