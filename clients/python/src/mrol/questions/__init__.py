"""What a map is asked, by whatever answers: each module has one question, or two that belong together, and its answer."""
