"""The paper's two studies, and the choice of its prior weight. Long work: resumable, in any number of processes."""
