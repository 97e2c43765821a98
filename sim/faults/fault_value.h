/* SPDX-License-Identifier: MIT */
/* fault_value: values of keys of fault rules: from text to a number, and into a field. Pure. */
#ifndef FAULTS_FAULT_VALUE_H
#define FAULTS_FAULT_VALUE_H

#include <stdbool.h>

enum fault_field {
    FAULT_FIELD_U8,
    FAULT_FIELD_U16,
    FAULT_FIELD_U32,
    FAULT_FIELD_I32,
    FAULT_FIELD_NUMBER, /* a double */
    FAULT_FIELD_SIDE,   /* enum fault_side: a word, no number */
};

/* Decimal, or hexadecimal behind 0x; a leading zero means nothing; fractions in FAULT_FIELD_NUMBER only. False: no such
 * number. Whole numbers up to 2^53 are exact. */
bool fault_value_read(const char *text, enum fault_field field, double *out);

/* Puts a number, which must be one of the field's type, into it. Not for FAULT_FIELD_SIDE. */
void fault_value_store(unsigned char *field, enum fault_field type, double number);

#endif
