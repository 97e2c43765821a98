/* SPDX-License-Identifier: MIT */
/*
 * The text of any code: found inside the table, and never none. Analysed by Eva in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * shows: program_error_text
 * mutant: core/program_check.c: i < sizeof texts => i <= sizeof texts
 * mutant: core/program_check.c: return "unknown error" => return NULL
 */
#include "proof.h"

#include "core/program_check.c"

int main(void)
{
    const char *text = program_error_text((int)any_between(INT32_MIN, INT32_MAX));
    prove(text != NULL);
    prove(text[0] != '\0');
    reached();
    return 0;
}
