"""What a model lacks, as a sum of one flexible function per component of the machine, each weighed by its evidence."""
