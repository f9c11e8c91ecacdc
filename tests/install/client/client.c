/* Adds a node and reads back what its input was set to. */
#include <stdio.h>
#include <sunder.h>

int main(void) {
    sunder_graph* graph = NULL;
    const char* json = NULL;
    if (sunder_graph_create(SUNDER_ABI_VERSION, &graph) != SUNDER_OK ||
        sunder_graph_add_node(graph, "floor", "collider") != SUNDER_OK ||
        sunder_graph_set(graph, "floor", "friction", "0.25") != SUNDER_OK ||
        sunder_graph_get(graph, "floor", "friction", &json) != SUNDER_OK)
        return 1;
    printf("%s friction %s\n", sunder_version(), json);
    sunder_graph_free(graph);
    return 0;
}
