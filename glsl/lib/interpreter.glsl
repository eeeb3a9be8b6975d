// SPDX-License-Identifier: GPL-3.0-or-later
// Nodes in order, each into a register.

void run_program(Material material) {
    int first = int(material.first_instruction);
    for (int i = first; i < first + int(material.instructions); i++) {
        Instruction node = instruction_at(i);
        registers[int(node.result)] = run_node(node);
    }
}
