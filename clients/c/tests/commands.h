/* Commands that a program reads, a line each: words, numbers and the memory for them. */
#ifndef COMMANDS_H
#define COMMANDS_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static inline void fail_to_read(void) {
    fprintf(stderr, "a command cannot be read\n");
    exit(2);
}

/* The next word of the line, as a number. */
static inline double number(void) {
    char *word = strtok(NULL, " ");
    if (word == NULL) fail_to_read();
    return strtod(word, NULL);
}

/* Not a byte more than is needed, for the address sanitizer to see. */
static inline void *memory(size_t bytes) {
    void *pointer = malloc(bytes);
    if (pointer == NULL && bytes > 0) fail_to_read();
    return pointer;
}

/* The next numbers of the line, to be freed. */
static inline float *numbers(size_t count) {
    size_t i;
    float *read = (float *)memory(count * sizeof *read);
    for (i = 0; i < count; i++) read[i] = (float)number();
    return read;
}

#endif
